//! `guidedog play` from outside: the page is served, and nothing else is.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

struct Server {
    process: Child,
    address: String,
}

impl Server {
    fn start() -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_guidedog"))
            .args(["play", "--no-open"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").unwrap().trim_end_matches('/').to_owned();
        Self { process, address }
    }

    /// The head and the body of the answer to raw bytes.
    fn send(&self, request: &[u8]) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        // The server may answer and hang up before it has read everything.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").expect("a head");
        (String::from_utf8_lossy(&answer[..end]).into_owned(), answer[end + 4..].to_vec())
    }

    fn get(&self, path: &str) -> (String, Vec<u8>) {
        self.send(format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", self.address).as_bytes())
    }

    fn status(&self, request: &str) -> u32 {
        self.send(request.as_bytes()).0.split(' ').nth(1).unwrap().parse().unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

#[test]
fn the_page_is_served_and_nothing_else() {
    let server = Server::start();
    assert!(server.address.starts_with("127.0.0.1:"), "{}", server.address);
    let (head, page) = server.get("/");
    assert!(head.starts_with("HTTP/1.1 200 OK") && head.contains("text/html"), "{head}");
    assert!(String::from_utf8(page).unwrap().contains("page.js"));
    for (file, kind) in [
        ("/page.js?x", "text/javascript"),
        ("/worker.js", "text/javascript"),
        ("/style.css", "text/css"),
        ("/simulation.wasm", "application/wasm"),
        ("/policies/locomotion.onnx", "application/octet-stream"),
        ("/policies/supervisor.onnx", "application/octet-stream"),
    ] {
        let (head, body) = server.get(file);
        assert!(head.contains("200 OK") && head.contains(kind), "{file}: {head}");
        assert!(head.contains(&format!("Content-Length: {}", body.len())), "{file}");
    }
    for path in [
        "/../Cargo.toml",
        "/..%2fCargo.toml",
        "/policies/../../etc/passwd",
        "/policies",
        "//",
        "/manifest.txt",
    ] {
        assert!(server.get(path).0.contains("404"), "{path}");
    }
    let (head, body) = server.send(format!("HEAD / HTTP/1.1\r\nHost: {}\r\n\r\n", server.address).as_bytes());
    assert!(head.contains("200 OK") && body.is_empty());
}

#[test]
fn what_is_not_a_small_request_from_this_machine_is_refused() {
    let server = Server::start();
    let host = &server.address;
    assert_eq!(server.status(&format!("POST / HTTP/1.1\r\nHost: {host}\r\n\r\n")), 405);
    assert_eq!(server.status(&format!("GET / HTTP/1.1\r\nHost: {host}\r\nContent-Length: 9\r\n\r\n")), 413);
    assert_eq!(server.status(&format!("GET /{} HTTP/1.1\r\nHost: {host}\r\n\r\n", "x".repeat(20_000))), 431);
    assert_eq!(server.status("\u{0}\u{1} nonsense\r\n\r\n"), 400);
    // A name elsewhere that was made to point here.
    assert_eq!(server.status("GET / HTTP/1.1\r\nHost: elsewhere.example\r\n\r\n"), 403);
    assert_eq!(server.status("GET / HTTP/1.1\r\n\r\n"), 403);
    // And it still serves.
    assert!(server.get("/").0.contains("200 OK"));
}
