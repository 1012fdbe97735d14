//! A small HTTP server for one page: fixed files, GET only, nothing read from the disk, nothing but loopback unless told.
//!
//! Written over `std` because that is all a page of ten files needs: a request is at most [`MAX_HEAD`] bytes, has no body,
//! and names a file of a fixed list, or the window of a training if there is one, or nothing.

pub mod files;
mod live;
mod request;

use std::io::{self, Read as _, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

pub use files::{FILES, File};
use request::{Refusal, Request};

use crate::watch::Window;

/// Longest head of a request \[bytes\].
pub const MAX_HEAD: usize = 8192;
/// Connections served at once; more are turned away.
const MAX_CONNECTIONS: usize = 64;
/// Bytes of a refused request that are still read.
const MAX_REFUSED: u64 = 1 << 20;
/// How long a client may take to send a request, or to take some of an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a client may take for all of an answer.
const MAX_ANSWER: Duration = Duration::from_secs(120);

/// A bound server, not serving yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    content: Content,
}

/// What is served.
#[derive(Clone, Debug)]
struct Content {
    files: &'static [File],
    window: Option<Arc<Window>>,
    loopback_only: bool,
}

impl Server {
    /// Binds to an address; port 0 takes any that is free.
    ///
    /// # Errors
    /// The address cannot be had.
    pub fn bind(address: SocketAddr, files: &'static [File]) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let loopback_only = listener.local_addr()?.ip().is_loopback();
        Ok(Self { listener, content: Content { files, window: None, loopback_only } })
    }

    /// Serves the window of a training, too.
    #[must_use]
    pub fn with_window(self, window: Arc<Window>) -> Self {
        Self { content: Content { window: Some(window), ..self.content }, ..self }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system does not tell.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Serves until the process ends.
    pub fn serve(self) {
        let open = Arc::new(AtomicUsize::new(0));
        for stream in self.listener.incoming() {
            // A connection that broke before it was taken is no reason to end.
            let Ok(stream) = stream else { continue };
            if open.fetch_add(1, Ordering::Relaxed) >= MAX_CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (content, open) = (self.content.clone(), open.clone());
            std::thread::spawn(move || {
                // A client that went away needs no answer.
                let _ = answer(stream, &content);
                open.fetch_sub(1, Ordering::Relaxed);
            });
        }
    }
}

fn answer(mut stream: TcpStream, content: &Content) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let request = match Request::read(&mut stream)? {
        Ok(request) => request,
        Err(refusal) => return refuse(&mut stream, refusal),
    };
    if content.loopback_only && !request.host.as_deref().is_some_and(is_loopback) {
        // A page elsewhere that had its name point here would otherwise read what is served to this machine only.
        return refuse(&mut stream, Refusal { status: "403 Forbidden", reason: "served on loopback only" });
    }
    if let Some(window) = content.window.as_ref().filter(|_| request.path == live::PATH) {
        return match live::answer(stream.try_clone()?, &request, window)? {
            Some(refusal) => refuse(&mut stream, refusal),
            None => Ok(()),
        };
    }
    match content.files.iter().find(|file| file.path == request.path) {
        Some(file) => {
            write!(
                stream,
                "HTTP/1.1 200 OK\r\nContent-Type: {}\r\nContent-Length: {}\r\n{COMMON}\r\n",
                file.content_type,
                file.bytes.len()
            )?;
            if !request.head_only {
                send(&mut stream, file.bytes, MAX_ANSWER)?;
            }
            stream.flush()
        }
        None => refuse(&mut stream, Refusal { status: "404 Not Found", reason: "there is no such file" }),
    }
}

/// Headers of every answer.
const COMMON: &str = "Connection: close\r\nCache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n\
    Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n";

fn refuse(stream: &mut TcpStream, Refusal { status, reason }: Refusal) -> io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\n{COMMON}\r\n{reason}\n",
        reason.len() + 1
    )?;
    stream.shutdown(Shutdown::Write)?;
    // Hanging up on bytes that were not read would throw away the answer on its way.
    stream.set_read_timeout(Some(Duration::from_secs(1)))?;
    let began = Instant::now();
    let (mut rest, mut chunk) = (stream.take(MAX_REFUSED), [0; 4096]);
    while began.elapsed() < PATIENCE && rest.read(&mut chunk)? > 0 {}
    Ok(())
}

/// Writes all bytes, or as many as the other side takes in the time there is: a client that takes one now and then would keep its
/// connection for days.
fn send(to: &mut impl Write, mut bytes: &[u8], within: Duration) -> io::Result<()> {
    let began = Instant::now();
    while !bytes.is_empty() {
        if began.elapsed() > within {
            return Err(io::ErrorKind::TimedOut.into());
        }
        match to.write(bytes)? {
            0 => return Err(io::ErrorKind::WriteZero.into()),
            count => bytes = &bytes[count..],
        }
    }
    Ok(())
}

/// Whether the value of a Host header names this machine.
fn is_loopback(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    };
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes one byte at a time.
    struct Reluctant(Vec<u8>);

    impl Write for Reluctant {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            std::thread::sleep(Duration::from_millis(2));
            self.0.push(bytes[0]);
            Ok(1)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_answer_is_sent_whole_or_given_up_when_its_time_is_over() {
        let mut patient = Reluctant(Vec::new());
        send(&mut patient, b"an answer", Duration::from_secs(60)).unwrap();
        assert_eq!(patient.0, b"an answer");
        let mut slow = Reluctant(Vec::new());
        let error = send(&mut slow, &[7; 10_000], Duration::from_millis(20)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(slow.0.len() < 100);
    }

    #[test]
    fn only_names_of_this_machine_are_loopback() {
        for host in ["localhost", "localhost:80", "127.0.0.1:7878", "127.8.8.8", "[::1]:7878", "LOCALHOST:1"]
        {
            assert!(is_loopback(host), "{host}");
        }
        for host in
            ["", "evil.example", "localhost.evil.example", "10.0.0.1:7878", "127.0.0.1.evil.example", "[::2]"]
        {
            assert!(!is_loopback(host), "{host}");
        }
    }
}
