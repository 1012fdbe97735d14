//! A short soak: `cargo run --release -p guidedog-tasks --example soak` is the long one.

mod soak;

#[test]
fn no_state_stops_being_numbers_in_two_hundred_thousand_steps() {
    let tally = soak::soak(256, 200_000, |_| ());
    assert!(tally.robot_steps >= 200_000);
    assert_eq!((tally.broken, tally.thrown), (0, 0), "{tally:?}");
    // They were not left alone, and nothing flew off: forces and kicks alone make 14 m/s, 27 rad/s and 39 rad/s here. Bounds are below
    // those of a sound state (30, 50 and 150), since only such states are measured.
    assert!(tally.falls > 100 && tally.joint_rate > 5.0, "{tally:?}");
    assert!(tally.base_speed < 20.0 && tally.base_rate < 40.0 && tally.joint_rate < 80.0, "{tally:?}");
}
