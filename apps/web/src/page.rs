//! The page's side of the simulation: bytes in, bytes out, every refusal in words.

use policy::{layout, read_onnx};
use tasks::guidance::{LocomotionPolicy, SupervisorPolicy};
use terrain::triangles::patch;

use crate::{description::describe, session::Session, settings::Settings};

/// Half the width of the ground that is drawn \[m\].
const DRAWN_M: f32 = 14.0;

/// Everything behind one page.
#[derive(Debug, Default)]
pub struct Page {
    locomotion: Option<LocomotionPolicy>,
    supervisor: Option<SupervisorPolicy>,
    session: Option<Session>,
}

/// Which of the two networks a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Network {
    /// 235 observations to twelve joint targets.
    Locomotion,
    /// 226 observations to a velocity command.
    Supervisor,
}

/// What is wrong when a call needs a session and there is none.
const NOT_BEGUN: &str = "there is no session yet";

impl Page {
    /// Nothing loaded.
    pub fn new() -> Self {
        Self::default()
    }

    /// Frame layout, robot, thresholds, presets, defaults, as JSON.
    pub fn describe(&self) -> String {
        describe().to_string()
    }

    /// Takes an ONNX file as whichever network its width says; a running session begins anew.
    ///
    /// # Errors
    /// It does not fit; the message says why. What was there before stays.
    pub fn load(&mut self, file: &[u8]) -> Result<Network, String> {
        let file = read_onnx(file).map_err(|error| error.to_string())?;
        let network = match file.mlp.inputs() {
            layout::LOCOMOTION_OBSERVATION => {
                self.locomotion = Some(LocomotionPolicy::new(file)?);
                Network::Locomotion
            }
            layout::SUPERVISOR_OBSERVATION => {
                self.supervisor = Some(SupervisorPolicy::new(file)?);
                Network::Supervisor
            }
            inputs => {
                return Err(format!(
                    "a network of {inputs} inputs, must have {} to walk or {} to supervise",
                    layout::LOCOMOTION_OBSERVATION,
                    layout::SUPERVISOR_OBSERVATION
                ));
            }
        };
        if let (Some(session), Some(locomotion), Some(supervisor)) =
            (&self.session, &self.locomotion, &self.supervisor)
        {
            self.session = Some(Session::new(session.settings().clone(), locomotion, supervisor)?);
        }
        Ok(network)
    }

    /// Takes settings as JSON; goes on where only minds and noise change, begins anew otherwise. True if it began anew.
    ///
    /// # Errors
    /// They are no settings, or out of range; what ran before runs on.
    pub fn configure(&mut self, json: &str) -> Result<bool, String> {
        let settings: Settings = serde_json::from_str(json).map_err(|error| format!("settings: {error}"))?;
        settings.validate()?;
        let (Some(locomotion), Some(supervisor)) = (&self.locomotion, &self.supervisor) else {
            return Err("a policy is missing: load both first".into());
        };
        match &mut self.session {
            Some(session) if session.settings().same_robots(&settings) => {
                session.adjust(settings, supervisor);
                Ok(false)
            }
            _ => {
                self.session = Some(Session::new(settings, locomotion, supervisor)?);
                Ok(true)
            }
        }
    }

    /// The running session.
    ///
    /// # Errors
    /// There is none yet.
    pub fn session(&mut self) -> Result<&mut Session, String> {
        self.session.as_mut().ok_or_else(|| NOT_BEGUN.into())
    }

    /// Makes control steps; appends the frame after each to `out`.
    ///
    /// # Errors
    /// There is no session yet.
    pub fn advance(&mut self, steps: u32, out: &mut Vec<f32>) -> Result<(), String> {
        let session = self.session()?;
        for _ in 0..steps {
            session.advance();
            session.write_frame(out);
        }
        Ok(())
    }

    /// Appends the triangles of the ground around (`x`, `y`) \[m\] to `out`.
    ///
    /// # Errors
    /// There is no session yet.
    pub fn ground(&mut self, x: f32, y: f32, out: &mut Vec<f32>) -> Result<(), String> {
        patch(self.session()?.ground(), x, y, DRAWN_M, out);
        Ok(())
    }
}
