//! `guidedog train --watch` from outside: what a page sees, what the server refuses, and that the training does not care.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use guidedog::policy::Checkpoint;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::{Message, WebSocket};

const PATIENCE: Duration = Duration::from_secs(120);

/// A folder that goes with the test; runs are made in it.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn train(&self, task: &str, iterations: u32, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
        command.current_dir(&self.0).args(["train", task, "--name", "small"]);
        let iterations = format!("training.iterations={iterations}");
        for setting in [
            &*iterations,
            "training.num_envs=96",
            "task.terrain=flat",
            "ppo.actor_hidden=[8]",
            "ppo.critic_hidden=[8]",
        ] {
            command.args(["--set", setting]);
        }
        command.args(more).stderr(Stdio::null()).stdout(Stdio::piped());
        command
    }

    /// What the training left: the newest checkpoint's content and the policy.
    fn result(&self) -> (Checkpoint, Vec<u8>) {
        let run = self.0.path().join("runs/small");
        let number = |path: &Path| path.file_stem()?.to_str()?.parse::<u64>().ok();
        let checkpoints = fs::read_dir(run.join("checkpoints")).unwrap().map(|entry| entry.unwrap().path());
        let newest = checkpoints.filter(|path| number(path).is_some()).max().expect("a checkpoint");
        (Checkpoint::load(&newest).unwrap(), fs::read(run.join("policy.onnx")).unwrap())
    }
}

/// A training that is watched.
struct Training {
    process: Child,
    /// What it prints; it must find someone who listens to its end.
    output: BufReader<ChildStdout>,
    host: String,
}

impl Training {
    fn start(folder: &Folder, task: &str, iterations: u32) -> Self {
        let mut process = folder.train(task, iterations, &["--watch", "--no-open"]).spawn().unwrap();
        let mut line = String::new();
        let mut output = BufReader::new(process.stdout.take().unwrap());
        output.read_line(&mut line).unwrap();
        let host = line.trim().strip_prefix("http://").unwrap().strip_suffix("/?watch").unwrap().to_owned();
        Self { process, output, host }
    }

    /// A page's socket; `origin` is where the page is from.
    fn watch(&self, origin: Option<&str>) -> Result<WebSocket<TcpStream>, u16> {
        let mut request = format!("ws://{}/live", self.host).into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(other) => panic!("{other}"),
        }
    }

    /// The status of an answer to raw bytes.
    fn status(&self, request: &str) -> u32 {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).split(' ').nth(1).unwrap().parse().unwrap()
    }

    /// The last thing it says.
    fn end(mut self) -> String {
        let mut said = String::new();
        self.output.read_to_string(&mut said).unwrap();
        assert!(self.process.wait().unwrap().success(), "{said}");
        said
    }
}

impl Drop for Training {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn told(message: &Message) -> Option<serde_json::Value> {
    message.to_text().ok().filter(|_| message.is_text()).map(|text| serde_json::from_str(text).unwrap())
}

#[test]
fn a_page_sees_robots_their_ground_and_curves_until_the_end() {
    let folder = Folder::new();
    let training = Training::start(&folder, "supervisor", 5);
    let mut socket = training.watch(Some(&format!("http://{}", training.host))).unwrap();
    let hello = told(&socket.read().unwrap()).unwrap();
    assert_eq!(
        (&hello["kind"], &hello["task"], &hello["run"]),
        (&"hello".into(), &"supervisor".into(), &"small".into())
    );
    assert_eq!((hello["robots"].as_u64(), hello["iterations"].as_u64()), (Some(96), Some(5)));
    let [header, row] = ["header", "row"].map(|name| hello["frame"][name].as_u64().unwrap() as usize);
    let (mut frames, mut grounds, mut last_row, mut ended) = (0, 0, 0.0, String::new());
    while ended.is_empty() {
        let message = socket.read().expect("a message before the end");
        if let Some(told) = told(&message) {
            match told["kind"].as_str().unwrap() {
                "curves" => {
                    let names: Vec<&str> =
                        told["names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
                    assert!(names.contains(&"behavior_reward/total") && names.contains(&"episode_return"));
                    let rows = told["rows"].as_array().unwrap();
                    assert!(rows.iter().all(|row| row.as_array().unwrap().len() == names.len() + 1));
                    last_row = rows.last().unwrap()[0].as_f64().unwrap();
                }
                "ended" => ended = told["how"].as_str().unwrap().to_owned(),
                other => panic!("{other}"),
            }
            continue;
        }
        let bytes = message.into_data();
        let numbers: Vec<f32> =
            bytes.chunks_exact(4).map(|chunk| f32::from_le_bytes(chunk.try_into().unwrap())).collect();
        if numbers[0] == 1.0 {
            grounds += 1;
            assert_eq!((numbers.len() - 4) % 9, 0);
            assert!(numbers.len() > 100);
        } else {
            assert!(grounds > 0, "robots come with their ground");
            frames += 1;
            let robots = numbers[2] as usize;
            assert!((1..=64).contains(&robots));
            assert_eq!(numbers.len(), 1 + header + robots * row);
            assert!(numbers.iter().all(|number| number.is_finite()));
        }
    }
    assert_eq!((ended.as_str(), last_row), ("finished", 5.0));
    assert!(frames > 24, "{frames} frames");
    assert!(training.end().contains("finished"));
}

#[test]
fn whoever_watches_and_however_they_go_the_training_gives_the_same_bits() {
    let (alone, seen) = (Folder::new(), Folder::new());
    let began = Instant::now();
    assert!(alone.train("locomotion", 12, &[]).status().unwrap().success());
    let took_alone = began.elapsed();
    let began = Instant::now();
    let training = Training::start(&seen, "locomotion", 12);
    // One that reads and says goodbye, one that breaks off, two that never read a thing.
    let mut polite = training.watch(None).unwrap();
    let mut rude = training.watch(None).unwrap();
    let silent = [training.watch(None).unwrap(), training.watch(None).unwrap()];
    for _ in 0..10 {
        polite.read().unwrap();
        rude.read().unwrap();
    }
    polite.close(None).unwrap();
    drop(rude);
    assert!(training.end().contains("finished"));
    drop(silent);
    let took_seen = began.elapsed();
    let (expected, found) = (alone.result(), seen.result());
    assert!(expected.0 == found.0, "another state");
    assert!(expected.1 == found.1, "another policy");
    // No reader can hold it up: a generous bound, for busy machines.
    assert!(
        took_seen < 4 * took_alone + Duration::from_secs(10),
        "{took_seen:?} beside {took_alone:?} alone"
    );
}

#[test]
fn only_its_own_page_may_watch_and_nobody_may_speak() {
    let folder = Folder::new();
    let training = Training::start(&folder, "locomotion", 100_000);
    let host = &training.host;
    assert!(host.starts_with("127.0.0.1:"), "{host}");
    // Pages from elsewhere, and names that were made to point here.
    assert_eq!(training.watch(Some("http://elsewhere.example")).unwrap_err(), 403);
    assert_eq!(training.watch(Some("null")).unwrap_err(), 403);
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13";
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    let request = |host: &str, rest: &str| format!("GET /live HTTP/1.1\r\nHost: {host}\r\n{rest}\r\n\r\n");
    let rebound =
        request("elsewhere.example", &format!("{upgrade}\r\n{key}\r\nOrigin: http://elsewhere.example"));
    assert_eq!(training.status(&rebound), 403);
    // What is no request for a WebSocket of today.
    assert_eq!(training.status(&request(host, "X: y")), 426);
    assert_eq!(training.status(&request(host, &format!("{upgrade}\r\nX: y").replace("13", "8"))), 426);
    assert_eq!(training.status(&request(host, upgrade)), 400);
    assert_eq!(training.status(&request(host, &format!("{upgrade}\r\nSec-WebSocket-Key: short"))), 400);
    assert_eq!(training.status(&format!("POST /live HTTP/1.1\r\nHost: {host}\r\n\r\n")), 405);
    assert_eq!(training.status(&format!("GET /../live HTTP/1.1\r\nHost: {host}\r\n\r\n")), 404);
    // The page is the same one.
    assert_eq!(training.status(&format!("GET /?watch HTTP/1.1\r\nHost: {host}\r\n\r\n")), 200);
    // Whoever says something, says it badly or at length is shown out with a reason.
    let closes = |bytes: &[u8]| {
        let mut socket = training.watch(None).unwrap();
        socket.get_mut().write_all(bytes).unwrap();
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            match socket.read() {
                Ok(Message::Close(frame)) => return frame.unwrap().code,
                Ok(_) => {}
                Err(error) => panic!("hung up without a reason: {error}"),
            }
        }
        panic!("still open");
    };
    // A masked text of two letters; the same unmasked; a frame of 64 KiB announced; reserved bits.
    assert_eq!(closes(&[0x81, 0x82, 0, 0, 0, 0, b'h', b'i']), CloseCode::Policy);
    assert_eq!(closes(&[0x81, 0x02, b'h', b'i']), CloseCode::Protocol);
    assert_eq!(closes(&[0x82, 0xff, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]), CloseCode::Size);
    assert_eq!(closes(&[0xf1, 0x80, 0, 0, 0, 0]), CloseCode::Protocol);
    // Eight may watch, the ninth hears why not; when one goes there is room.
    let wait_for_room = || {
        let began = Instant::now();
        loop {
            match training.watch(None) {
                Ok(socket) => return socket,
                Err(503) if began.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(50)),
                Err(status) => panic!("{status}"),
            }
        }
    };
    let mut readers: Vec<_> = (0..8).map(|_| wait_for_room()).collect();
    assert_eq!(training.watch(None).unwrap_err(), 503);
    readers.pop();
    wait_for_room();
}

#[test]
fn a_port_without_watch_is_refused() {
    let folder = Folder::new();
    let output = folder.train("locomotion", 1, &["--port", "8080"]).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--watch"));
}
