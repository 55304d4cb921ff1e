//! Recordings in MCAP.
