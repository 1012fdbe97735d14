//! The locomotion and guidance environments.
