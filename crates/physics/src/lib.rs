//! Batched rigid-body dynamics, actuators, contacts and time stepping.
