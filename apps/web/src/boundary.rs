//! The functions a browser calls: numbers and byte ranges only, so that no generated glue is needed.
//!
//! One page lives in one instance. Bytes go in through a buffer that [`input`] makes room in; what comes out, a text or 32-bit
//! floats, lies where [`output`] says until the next call. Functions return 1 with a message as output where
//! they refuse, and another number, 0 unless it says more, where they do not.

// Exporting under a fixed name is "unsafe" to the compiler because two crates could claim the same one; nothing else here is.
#![allow(unsafe_code)]

use std::cell::RefCell;

use crate::page::{Network, Page};

#[derive(Default)]
struct Instance {
    page: Page,
    input: Vec<u8>,
    text: String,
    numbers: Vec<f32>,
    /// Where the output of the last call is: address and length in bytes.
    output: (usize, usize),
}

thread_local! {
    static INSTANCE: RefCell<Instance> = RefCell::default();
}

impl Instance {
    fn tell(&mut self, text: String) {
        self.text = text;
        self.output = (self.text.as_ptr() as usize, self.text.len());
    }

    fn finish(&mut self, result: Result<(), String>) -> u32 {
        let failed = result.is_err();
        self.tell(result.err().unwrap_or_default());
        u32::from(failed)
    }

    /// Runs something that writes numbers.
    fn numbers(&mut self, write: impl FnOnce(&mut Page, &mut Vec<f32>) -> Result<(), String>) -> u32 {
        self.numbers.clear();
        match write(&mut self.page, &mut self.numbers) {
            Ok(()) => {
                self.output = (self.numbers.as_ptr() as usize, size_of_val(&self.numbers[..]));
                0
            }
            refused => self.finish(refused),
        }
    }
}

fn with<T>(work: impl FnOnce(&mut Instance) -> T) -> T {
    INSTANCE.with_borrow_mut(work)
}

/// Makes room for `length` bytes of input; returns their address.
#[unsafe(no_mangle)]
extern "C" fn input(length: usize) -> usize {
    with(|instance| {
        instance.input.clear();
        instance.input.resize(length, 0);
        instance.input.as_ptr() as usize
    })
}

/// Address of the last call's output.
#[unsafe(no_mangle)]
extern "C" fn output() -> usize {
    with(|instance| instance.output.0)
}

/// Length of the last call's output in bytes.
#[unsafe(no_mangle)]
extern "C" fn output_length() -> usize {
    with(|instance| instance.output.1)
}

/// Gives the description as JSON.
#[unsafe(no_mangle)]
extern "C" fn describe() {
    with(|instance| instance.tell(instance.page.describe()));
}

/// Takes the input as an ONNX file: 2 for a locomotion policy, 3 for a supervisor.
#[unsafe(no_mangle)]
extern "C" fn load() -> u32 {
    with(|instance| match instance.page.load(&instance.input) {
        Ok(Network::Locomotion) => 2,
        Ok(Network::Supervisor) => 3,
        Err(message) => instance.finish(Err(message)),
    })
}

/// Takes the input as settings in JSON; 2 where the session began anew.
#[unsafe(no_mangle)]
extern "C" fn configure() -> u32 {
    with(|instance| {
        let json = String::from_utf8_lossy(&instance.input).into_owned();
        match instance.page.configure(&json) {
            Ok(anew) => 2 * u32::from(anew),
            Err(message) => instance.finish(Err(message)),
        }
    })
}

/// Everyone back to the start.
#[unsafe(no_mangle)]
extern "C" fn reset() -> u32 {
    with(|instance| {
        let done = instance.page.session().map(|session| session.reset());
        instance.finish(done)
    })
}

/// Holds a pull \[N\].
#[unsafe(no_mangle)]
extern "C" fn pull(x: f32, y: f32, z: f32) -> u32 {
    with(|instance| {
        let done = instance.page.session().map(|session| session.pull([x, y, z]));
        instance.finish(done)
    })
}

/// Adds a pull \[N\] for a while \[s\].
#[unsafe(no_mangle)]
extern "C" fn tug(x: f32, y: f32, z: f32, duration_s: f32) -> u32 {
    with(|instance| {
        let done = instance.page.session().map(|session| session.tug([x, y, z], duration_s));
        instance.finish(done)
    })
}

/// Makes control steps and gives the frame after each; with 0 the frame of now.
#[unsafe(no_mangle)]
extern "C" fn advance(steps: u32) -> u32 {
    with(|instance| {
        instance.numbers(|page, out| {
            if steps == 0 {
                page.session()?.write_frame(out);
            }
            page.advance(steps, out)
        })
    })
}

/// Gives the triangles of the ground around (`x`, `y`) \[m\].
#[unsafe(no_mangle)]
extern "C" fn ground(x: f32, y: f32) -> u32 {
    with(|instance| instance.numbers(|page, out| page.ground(x, y, out)))
}
