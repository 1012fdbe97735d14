//! The committed page is the one its sources make, and small enough to be loaded by anyone.

use std::io::Write as _;
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

/// What a visitor loads before the dog walks, compressed as web servers do it.
#[test]
fn the_first_load_is_small() {
    let mut total = 0;
    for name in [
        "index.html",
        "style.css",
        "page.js",
        "worker.js",
        "simulation.wasm",
        "policies/locomotion.onnx",
        "policies/supervisor.onnx",
    ] {
        let bytes = std::fs::read(root().join(DIST).join(name)).unwrap();
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(&bytes).unwrap();
        total += encoder.finish().unwrap().len();
    }
    println!("{total} bytes");
    assert!(total <= 2_500_000, "{total} bytes");
}

/// The page must work where nothing but this host is reached, and must not tell where it was built.
#[test]
fn nothing_points_elsewhere() {
    for name in ["index.html", "style.css", "page.js", "worker.js"] {
        let text = std::fs::read_to_string(root().join(DIST).join(name)).unwrap();
        for word in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(\"http"] {
            assert!(!text.contains(word), "{name} has {word}");
        }
    }
    let module = std::fs::read(root().join(DIST).join("simulation.wasm")).unwrap();
    for place in ["/home/", "/root/", "/registry/", "crates.io"] {
        assert!(!module.windows(place.len()).any(|w| w == place.as_bytes()), "the module names {place}");
    }
}
