//! The head of an HTTP request, and what is refused before anything is looked up.

use std::io::{self, Read};
use std::time::Instant;

use super::{MAX_HEAD, PATIENCE};

/// Most headers of a request.
const MAX_HEADERS: usize = 64;

/// What the server needs of a request.
#[derive(Debug, PartialEq)]
pub(super) struct Request {
    /// The path as it was sent, without the query.
    pub(super) path: String,
    /// HEAD, not GET.
    pub(super) head_only: bool,
    pub(super) host: Option<String>,
    /// Where the page is from that asks, if a page does.
    pub(super) origin: Option<String>,
    pub(super) upgrade: Upgrade,
}

/// The headers of a request for a WebSocket.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Upgrade {
    pub(super) protocol: Option<String>,
    pub(super) connection: Option<String>,
    pub(super) version: Option<String>,
    pub(super) key: Option<String>,
}

/// An answer that is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Refusal {
    pub(super) status: &'static str,
    pub(super) reason: &'static str,
}

impl Request {
    /// Reads a request's head.
    pub(super) fn read(stream: &mut impl Read) -> io::Result<Result<Self, Refusal>> {
        let mut head = Vec::new();
        let mut chunk = [0; 1024];
        let began = Instant::now();
        let too_slow = Refusal { status: "408 Request Timeout", reason: "the request did not end" };
        loop {
            if began.elapsed() > PATIENCE {
                return Ok(Err(too_slow));
            }
            let count = match stream.read(&mut chunk) {
                Ok(count) => count,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(Err(too_slow));
                }
                Err(error) => return Err(error),
            };
            head.extend_from_slice(&chunk[..count]);
            if head.len() > MAX_HEAD {
                let status = "431 Request Header Fields Too Large";
                return Ok(Err(Refusal { status, reason: "the request is longer than 8192 bytes" }));
            }
            match Self::parse(&head) {
                Some(done) => return Ok(done),
                None if count == 0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                None => {}
            }
        }
    }

    /// The request if its head has ended.
    fn parse(head: &[u8]) -> Option<Result<Self, Refusal>> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut parsed = httparse::Request::new(&mut headers);
        let refuse = |status, reason| Some(Err(Refusal { status, reason }));
        match parsed.parse(head) {
            Ok(httparse::Status::Partial) => return None,
            Ok(httparse::Status::Complete(_)) => {}
            Err(httparse::Error::TooManyHeaders) => {
                return refuse("431 Request Header Fields Too Large", "more than 64 headers");
            }
            Err(_) => return refuse("400 Bad Request", "this is no HTTP request"),
        }
        let head_only = match parsed.method {
            Some("GET") => false,
            Some("HEAD") => true,
            _ => return refuse("405 Method Not Allowed", "only GET and HEAD are allowed"),
        };
        let value = |name: &str| {
            let header = parsed.headers.iter().find(|header| header.name.eq_ignore_ascii_case(name))?;
            String::from_utf8(header.value.to_vec()).ok()
        };
        if value("content-length").is_some_and(|length| length.trim() != "0")
            || value("transfer-encoding").is_some()
        {
            return refuse("413 Content Too Large", "a request here has no body");
        }
        let path = parsed.path.unwrap_or_default().split('?').next().unwrap_or_default();
        if !path.starts_with('/') {
            return refuse("400 Bad Request", "the path must begin with /");
        }
        let upgrade = Upgrade {
            protocol: value("upgrade"),
            connection: value("connection"),
            version: value("sec-websocket-version"),
            key: value("sec-websocket-key"),
        };
        Some(Ok(Self {
            path: path.to_owned(),
            head_only,
            host: value("host"),
            origin: value("origin"),
            upgrade,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Request, Refusal> {
        Request::read(&mut text.as_bytes()).unwrap()
    }

    fn status(text: &str) -> &'static str {
        read(text).unwrap_err().status
    }

    #[test]
    fn a_request_is_read_without_its_query() {
        let request = read("GET /page.js?x=1 HTTP/1.1\r\nHost: localhost:1\r\n\r\n").unwrap();
        assert_eq!((request.path.as_str(), request.head_only), ("/page.js", false));
        assert_eq!(request.host.as_deref(), Some("localhost:1"));
    }

    #[test]
    fn what_is_not_a_small_get_is_refused() {
        assert_eq!(status("POST / HTTP/1.1\r\n\r\n"), "405 Method Not Allowed");
        assert_eq!(status("GET / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello"), "413 Content Too Large");
        assert_eq!(status("GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"), "413 Content Too Large");
        assert_eq!(status("GET http://elsewhere/ HTTP/1.1\r\n\r\n"), "400 Bad Request");
        assert_eq!(status("\u{1}\u{2}\u{3}\r\n\r\n"), "400 Bad Request");
        let long = format!("GET / HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(MAX_HEAD));
        assert_eq!(status(&long), "431 Request Header Fields Too Large");
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "X: y\r\n".repeat(MAX_HEADERS + 1));
        assert_eq!(status(&many), "431 Request Header Fields Too Large");
    }

    #[test]
    fn a_request_cut_short_is_an_error() {
        assert!(Request::read(&mut "GET / HT".as_bytes()).is_err());
    }
}
