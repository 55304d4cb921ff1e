//! A viewer of the Foxglove WebSocket, of the few messages that tests need.
#![allow(dead_code, clippy::unwrap_used, reason = "each test uses a part of it, and fails by panicking")]

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use tungstenite::{ClientRequestBuilder, Message, WebSocket, client::client};

/// A connected viewer.
pub(crate) struct Viewer {
    socket: WebSocket<TcpStream>,
    /// Channels by their topics.
    pub(crate) channels: BTreeMap<String, Value>,
    subscribed: BTreeMap<u32, String>,
}

impl Viewer {
    /// Connects, and hears which topics there are.
    pub(crate) fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let request = ClientRequestBuilder::new(format!("ws://{address}/").parse().unwrap())
            .with_sub_protocol("foxglove.sdk.v1");
        let (socket, _) = client(request, stream).unwrap();
        let mut viewer = Self { socket, channels: BTreeMap::new(), subscribed: BTreeMap::new() };
        while viewer.channels.is_empty() {
            let Message::Text(text) = viewer.socket.read().unwrap() else { continue };
            let said: Value = serde_json::from_str(&text).unwrap();
            if said["op"] == "serverInfo" {
                assert_eq!(said["capabilities"], json!([]), "nothing can be sent");
            }
            for channel in said["channels"].as_array().into_iter().flatten() {
                viewer.channels.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
            }
        }
        viewer
    }

    /// Asks for topics.
    pub(crate) fn subscribe(&mut self, topics: &[&str]) {
        for topic in topics {
            let id = self.subscribed.len() as u32;
            self.subscribed.insert(id, (*topic).to_owned());
            let subscription = json!({ "id": id, "channelId": self.channels[*topic]["id"] });
            let text = json!({ "op": "subscribe", "subscriptions": [subscription] }).to_string();
            self.socket.send(Message::text(text)).unwrap();
        }
    }

    /// The next message: its topic, its stamp and its bytes.
    pub(crate) fn message(&mut self) -> (String, i64, Vec<u8>) {
        loop {
            let Message::Binary(bytes) = self.socket.read().unwrap() else { continue };
            // An opcode, the subscription, the stamp, and the message; numbers are little-endian.
            assert_eq!(bytes[0], 1);
            let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
            let stamp_ns = i64::from_le_bytes(bytes[5..13].try_into().unwrap());
            return (self.subscribed[&subscription].clone(), stamp_ns, bytes[13..].to_vec());
        }
    }
}
