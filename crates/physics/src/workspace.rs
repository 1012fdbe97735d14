//! Scratch memory of a step.
use crate::engine::Engine;
use spatial::Lane;

/// Scratch memory of a step, and the contact impulses kept for warm starting.
#[derive(Clone, Debug)]
pub(crate) struct Workspace<L> {
    marker: std::marker::PhantomData<L>,
}
impl<L: Lane> Workspace<L> {
    pub(crate) fn new(_engine: &Engine<L>) -> Self {
        Self { marker: std::marker::PhantomData }
    }
    pub(crate) fn forget_contacts(&mut self, _lane: usize) {}
}
