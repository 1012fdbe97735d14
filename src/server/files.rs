//! The built page, inside the program.

use crate::policies;

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub struct File {
    /// Its path on the server.
    pub path: &'static str,
    /// What it is to a browser.
    pub content_type: &'static str,
    /// Its content.
    pub bytes: &'static [u8],
}

macro_rules! built {
    ($path:literal, $name:literal, $content_type:literal) => {
        File {
            path: $path,
            content_type: $content_type,
            bytes: include_bytes!(concat!("../../apps/web/dist/", $name)),
        }
    };
}

/// All files of `apps/web/dist`. The policies are the ones the program has anyway; the page's are copies of them.
pub static FILES: &[File] = &[
    built!("/", "index.html", "text/html; charset=utf-8"),
    built!("/index.html", "index.html", "text/html; charset=utf-8"),
    built!("/style.css", "style.css", "text/css; charset=utf-8"),
    built!("/page.js", "page.js", "text/javascript; charset=utf-8"),
    built!("/worker.js", "worker.js", "text/javascript; charset=utf-8"),
    built!("/simulation.wasm", "simulation.wasm", "application/wasm"),
    File {
        path: "/policies/locomotion.onnx",
        content_type: "application/octet-stream",
        bytes: policies::LOCOMOTION,
    },
    File {
        path: "/policies/supervisor.onnx",
        content_type: "application/octet-stream",
        bytes: policies::SUPERVISOR,
    },
];
