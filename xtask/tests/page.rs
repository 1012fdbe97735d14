//! The committed page is the one its sources make, and small enough to be loaded by anyone.

use std::path::Path;

use xtask::manifest::{DIST, NAME, compute, differences, from_text};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

#[test]
fn the_built_page_is_as_old_as_its_sources() {
    let recorded = from_text(&std::fs::read_to_string(root().join(DIST).join(NAME)).unwrap()).unwrap();
    let now = compute(root()).unwrap();
    let differing = differences(&recorded, &now);
    assert!(
        differing.is_empty(),
        "changed since the page was built: {differing:?}; build it: cargo run -p xtask -- web"
    );
}
