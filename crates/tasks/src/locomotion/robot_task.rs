//! One robot's episode: what it is told, what pushes it, what it did.

use super::mean_error::MeanError;
use crate::{
    archive::{Archive, Archived},
    simulation::{BaseMotion, CONTROL_PERIOD_S},
};

/// The task's side of one robot.
#[derive(Clone, Debug, Default)]
pub(super) struct RobotTask {
    /// Episodes begun.
    pub(super) episode: u32,
    /// Control steps of this episode.
    pub(super) step: u32,
    /// Steps it counts as having lived before, so that episodes do not all end together.
    pub(super) head_start: u32,
    /// Terrain level.
    pub(super) level: usize,
    /// Terrain column, constant.
    pub(super) column: usize,
    /// In this episode.
    pub(super) way: Way,
    /// v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub(super) command: [f32; 3],
    /// Since that command was given.
    pub(super) mean_error: MeanError,
    /// Where the robot was then: x, y \[m\].
    pub(super) told_at: [f32; 2],
    /// Step at which the next command is drawn.
    pub(super) next_command: u32,
    /// Step at which the force ends, and at which the next is drawn.
    pub(super) force_end: u32,
    pub(super) next_force: u32,
    /// Raw action of the last step.
    pub(super) previous_action: [f32; 12],
}

impl RobotTask {
    /// Gives a new command to a robot at x, y \[m\].
    pub(super) fn tell(&mut self, command: [f32; 3], position: [f32; 2]) {
        self.command = command;
        self.told_at = position;
        self.mean_error = MeanError::default();
    }
}

/// How far a robot was told to go, and how far it went that way: what the terrain curriculum decides by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Way {
    /// Way made good along the commands \[m\].
    pub progress: f32,
    /// Way commanded \[m\].
    pub commanded: f32,
}

impl Way {
    /// Adds a control step under what the command means: v_x, v_y \[m/s\], ω_z.
    pub fn walk(&mut self, [x, y, _]: [f32; 3], motion: &BaseMotion) {
        let speed = x.hypot(y);
        if speed > 0.0 {
            let [v_x, v_y, _] = motion.linear_velocity;
            self.progress += (x * v_x + y * v_y) / speed * CONTROL_PERIOD_S;
            self.commanded += speed * CONTROL_PERIOD_S;
        }
    }
}

impl Archived for RobotTask {
    fn visit(&mut self, archive: &mut impl Archive) {
        for word in [
            &mut self.episode,
            &mut self.step,
            &mut self.head_start,
            &mut self.next_command,
            &mut self.force_end,
            &mut self.next_force,
        ] {
            archive.u32(word);
        }
        archive.index(&mut self.level);
        archive.f32(&mut self.way.progress);
        archive.f32(&mut self.way.commanded);
        archive.f32s(&mut self.command);
        archive.f32s(&mut self.mean_error.0);
        archive.f32s(&mut self.told_at);
        archive.f32s(&mut self.previous_action);
    }
}
