//! A training's window over a WebSocket: texts tell curves, binary messages are robots and their ground. Nothing comes in but
//! the end.

use std::io::{self, Write as _};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use terrain::triangles::patch;
use tungstenite::error::Error;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocket, WebSocketConfig};
use tungstenite::{Bytes, Message};

use super::request::{Refusal, Request};
use crate::watch::{Cursor, Ground, News, Window};

/// Where the window is.
pub(super) const PATH: &str = "/live";
/// Most pages that watch at once.
const MAX_READERS: usize = 8;
/// Longest message from a page \[bytes\]; there is nothing it could say.
const MAX_MESSAGE: usize = 1024;
/// Longest time between two looks at what a page says.
const TICK: Duration = Duration::from_millis(100);
/// Half the width of the ground that is shown \[m\].
const SHOWN_M: f32 = 13.0;
/// The first number of a binary message: what it is.
const FRAME: f32 = 0.0;
const GROUND: f32 = 1.0;

/// Answers a request for the window: a WebSocket, or why not.
pub(super) fn answer(
    mut stream: TcpStream,
    request: &Request,
    window: &Arc<Window>,
) -> io::Result<Option<Refusal>> {
    let key = match accept(request) {
        Ok(key) => key,
        Err(refusal) => return Ok(Some(refusal)),
    };
    // Counted first: of two that come at once, both would find room for one.
    let cursor = window.reader();
    if window.readers() > MAX_READERS {
        return Ok(Some(Refusal {
            status: "503 Service Unavailable",
            reason: "too many pages watch already",
        }));
    }
    write!(
        stream,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {key}\r\n\r\n"
    )?;
    // Between two messages, one look whether the page said something.
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    stream.set_nodelay(true)?;
    let config = WebSocketConfig::default()
        .read_buffer_size(4096)
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE));
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    // Whatever ends this, the page went away or will see that nothing comes.
    let _ = show(&mut socket, cursor, window);
    Ok(None)
}

/// The key that seals the handshake.
fn accept(request: &Request) -> Result<String, Refusal> {
    let upgrade = &request.upgrade;
    let has = |value: &Option<String>, word: &str| {
        value.as_ref().is_some_and(|list| list.split(',').any(|part| part.trim().eq_ignore_ascii_case(word)))
    };
    if request.head_only || !has(&upgrade.protocol, "websocket") || !has(&upgrade.connection, "upgrade") {
        return Err(Refusal { status: "426 Upgrade Required", reason: "only a WebSocket is served here" });
    }
    if upgrade.version.as_deref() != Some("13") {
        return Err(Refusal { status: "426 Upgrade Required", reason: "the version must be 13" });
    }
    // A page elsewhere could open a socket to here, and browsers let it read what comes.
    let own = request.host.as_deref().unwrap_or_default();
    let authority = |origin: &str| origin.split_once("://").map(|(_, authority)| authority.to_owned());
    if let Some(origin) = &request.origin
        && authority(origin).as_deref() != Some(own)
    {
        return Err(Refusal { status: "403 Forbidden", reason: "only the page of this server may watch" });
    }
    match &upgrade.key {
        // Sixteen bytes in base64.
        Some(key) if key.len() == 24 && key.ends_with("==") => Ok(derive_accept_key(key.as_bytes())),
        _ => Err(Refusal { status: "400 Bad Request", reason: "Sec-WebSocket-Key is missing or no key" }),
    }
}

/// Tells a page what is new until it goes or the training ends.
fn show(socket: &mut WebSocket<TcpStream>, mut cursor: Cursor, window: &Window) -> Result<(), Error> {
    socket.send(Message::text(window.hello()))?;
    loop {
        let News { ground, frames, curves, ended } = cursor.news(TICK);
        if let Some(ground) = ground {
            socket.write(ground_message(&ground))?;
        }
        for frame in frames {
            socket.write(binary([FRAME].iter().chain(frame.iter())))?;
        }
        if let Some(curves) = curves {
            socket.write(Message::text(curves))?;
        }
        if let Some(how) = ended {
            socket.write(Message::text(serde_json::json!({ "kind": "ended", "how": how }).to_string()))?;
        }
        socket.flush()?;
        if ended.is_some() {
            return close(socket, CloseCode::Normal, "the training has ended");
        }
        match socket.read() {
            Ok(Message::Text(_) | Message::Binary(_)) => {
                return close(socket, CloseCode::Policy, "nothing can be said here");
            }
            Ok(_) => {}
            Err(Error::Io(error))
                if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
            Err(Error::Capacity(_)) => {
                return close(socket, CloseCode::Size, "a message of more than 1024 bytes");
            }
            Err(Error::Protocol(_) | Error::Utf8(_)) => {
                return close(socket, CloseCode::Protocol, "this is no WebSocket frame");
            }
            Err(other) => return Err(other),
        }
    }
}

fn close(socket: &mut WebSocket<TcpStream>, code: CloseCode, reason: &'static str) -> Result<(), Error> {
    socket.close(Some(CloseFrame { code, reason: reason.into() }))?;
    socket.flush()?;
    // What is still on its way is read, or hanging up would throw away the reason.
    socket.get_mut().set_read_timeout(Some(TICK))?;
    for _ in 0..10 {
        if socket.read().is_err() {
            break;
        }
    }
    Ok(())
}

fn ground_message(Ground { field, sample, place: [x, y] }: &Ground) -> Message {
    let mut numbers = vec![GROUND, *sample as f32, *x, *y];
    patch(field, *x, *y, SHOWN_M, &mut numbers);
    binary(numbers.iter())
}

/// Little-endian 32-bit floats.
fn binary<'a>(numbers: impl Iterator<Item = &'a f32>) -> Message {
    Message::Binary(Bytes::from_iter(numbers.flat_map(|number| number.to_le_bytes())))
}
