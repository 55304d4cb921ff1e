//! Live events as channels of a Foxglove WebSocket: viewers display them as they happen.
//!
//! A message is copied into a queue of every viewer that requested its topic. A queue that is full loses its oldest message. So nobody who
//! publishes waits for a viewer, and a viewer that stalls takes a bounded memory. Viewers can request nothing else: the server has no
//! capability by which a viewer could send something.

mod channels;
mod live_view;
mod live_view_error;
mod own_schemas;

pub use channels::{ESTIMATE_TOPIC, LiveChannels, LogLevel, WELD_TOPIC};
pub use live_view::LiveView;
pub use live_view_error::LiveViewError;
