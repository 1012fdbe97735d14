//! What no engine can be made of: each refusal names the value, what it is and what it may be.

use std::{panic, sync::Arc};

use physics::{Actuator, Config, Engine};
use robot::{Link, RobotModel};
use spatial::{Inertia, Vec3};
use terrain::HeightField;

/// What `Engine::new` says to a ground and settings; nothing where it takes them.
fn refusal(change: impl Fn(&mut HeightField, &mut Config)) -> Option<String> {
    let inertia = Inertia::from_center_of_mass(1.0, Vec3::zero(), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let body = RobotModel {
        name: "body".to_owned(),
        links: vec![Link { name: "body".to_owned(), inertia }],
        joints: vec![],
        contacts: vec![],
        harness: None,
    };
    let (mut ground, mut config) = (HeightField::flat(0.0), Config::default());
    change(&mut ground, &mut config);
    let make = move || drop(Engine::<f64>::new(body, Arc::new(ground), config));
    let panic = panic::catch_unwind(make).err()?;
    Some(*panic.downcast::<String>().expect("a message"))
}

#[track_caller]
fn assert_refused(change: impl Fn(&mut HeightField, &mut Config), message: &str) {
    assert_eq!(refusal(change).as_deref(), Some(message));
}

#[test]
fn settings_are_checked() {
    assert_refused(|_, c| c.time_step = 0.0, "time_step is 0, must be finite and above 0");
    assert_refused(|_, c| c.time_step = f64::NAN, "time_step is NaN, must be finite and above 0");
    assert_refused(|_, c| c.gravity[2] = f64::NAN, "gravity is [0.0, 0.0, NaN], must be finite");
    assert_refused(|_, c| c.error_reduction = 1.5, "error_reduction is 1.5, must be 0 to 1");
    let fast = |_: &mut HeightField, c: &mut Config| c.max_depenetration_speed = f64::INFINITY;
    assert_refused(fast, "max_depenetration_speed is inf, must be finite, 0 or more");
    assert_refused(|_, c| c.contact_margin = -0.1, "contact_margin is -0.1, must be finite, 0 or more");
}

#[test]
fn servos_are_checked() {
    let servo =
        |change: fn(&mut Actuator), message: &str| assert_refused(|_, c| change(&mut c.actuator), message);
    servo(|a| a.velocity_limit = 0.0, "actuator.velocity_limit is 0, must be finite and above 0");
    servo(|a| a.stiffness = -1.0, "actuator.stiffness is -1, must be finite, 0 or more");
    servo(|a| a.damping = -1.0, "actuator.damping is -1, must be finite, 0 or more");
    servo(
        |a| a.saturation_torque = f64::INFINITY,
        "actuator.saturation_torque is inf, must be finite, 0 or more",
    );
    servo(|a| a.effort_limit = f64::NAN, "actuator.effort_limit is NaN, must be finite, 0 or more");
}

#[test]
fn the_ground_is_checked() {
    assert_refused(|g, _| g.cell_size = 0.0, "cell_size is 0 m, must be finite and above 0");
    assert_refused(|g, _| g.cell_size = f32::INFINITY, "cell_size is inf m, must be finite and above 0");
    assert_refused(|g, _| g.origin[1] = f32::NAN, "origin is [-0.05, NaN] m, must be finite");
    assert_refused(|g, _| g.columns = 0, "columns is 0, must be 1 or more");
    assert_refused(|g, _| g.rows = 0, "rows is 0, must be 1 or more");
    assert_refused(|g, _| g.columns = 2, "cells has 1 entries, must have 2 × 1");
    // Their product is no number.
    let endless = |g: &mut HeightField, _: &mut Config| (g.columns, g.rows) = (usize::MAX, 2);
    assert_refused(endless, &format!("cells has 1 entries, must have {} × 2", usize::MAX));
    assert_refused(|g, _| g.cells[0][3] = f32::NAN, "cell 0 is [0.0, 0.0, 0.0, NaN] m, must be finite");
}

#[test]
fn what_is_allowed_is_taken() {
    assert_eq!(refusal(|_, _| ()), None);
    let idle = |_: &mut HeightField, c: &mut Config| {
        (c.error_reduction, c.contact_margin, c.max_depenetration_speed) = (0.0, 0.0, 0.0);
        (c.actuator.stiffness, c.actuator.damping) = (0.0, 0.0);
        (c.actuator.saturation_torque, c.actuator.effort_limit) = (0.0, 0.0);
    };
    assert_eq!(refusal(idle), None);
}
