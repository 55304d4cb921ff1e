//! Tests of `trueline-watch` by its public interface, a file a subject. One program: it links once, and its tests share the processors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod blindness;
mod common;
mod curved_parts;
mod export;
mod innovation;
mod inside;
mod links;
mod mended;
mod mqtt;
mod plates;
mod production;
mod state;
mod tell;
