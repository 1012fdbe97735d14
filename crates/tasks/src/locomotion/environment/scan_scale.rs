//! The height scan's factor is the setting's; those of other inputs do not depend on it.

use policy::{VecEnv as _, layout};

use super::LocomotionEnv;
use crate::locomotion::{LocomotionConfig, Terrain};

#[test]
fn only_the_height_scan_has_the_factor_that_is_set() {
    let scale = |scan_scale| {
        let config = LocomotionConfig { scan_scale, terrain: Terrain::Flat, ..LocomotionConfig::default() };
        LocomotionEnv::new(config, 16, 1).unwrap().observation_scale()
    };
    let (usual, large) = (scale(2.0), scale(5.0));
    let scan = layout::LOCOMOTION_SCAN.range();
    assert!(usual[scan.clone()].iter().all(|&factor| factor == 2.0));
    assert!(large[scan.clone()].iter().all(|&factor| factor == 5.0));
    assert_eq!(usual[..scan.start], large[..scan.start]);
    assert_eq!(usual[scan.end..], large[scan.end..]);
}
