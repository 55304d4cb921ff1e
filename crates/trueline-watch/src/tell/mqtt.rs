//! A topic of an MQTT broker: publishes at least once (QoS 1), until the broker acknowledges.

use super::receiver::{Receiver, ReceiverError};
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use std::time::{Duration, Instant};

const PORT: u16 = 1883;

/// A topic.
pub(super) struct Topic {
    address: String,
    host: String,
    port: u16,
    topic: String,
    patience: Duration,
}

impl Topic {
    /// The topic at `mqtt://HOST:PORT/TOPIC`.
    pub(super) fn at(address: &str, patience: Duration) -> Result<Self, ReceiverError> {
        let rest = address.strip_prefix("mqtt://").ok_or(ReceiverError::Kind)?;
        let (server, topic) = rest.split_once('/').ok_or(ReceiverError::Missing("topic"))?;
        if topic.is_empty() {
            return Err(ReceiverError::Missing("topic"));
        }
        if topic.contains(['+', '#', '\0']) {
            return Err(ReceiverError::Malformed(
                "a topic to publish to must not contain +, # or null".to_owned(),
            ));
        }
        let (host, port) = match server.rsplit_once(':') {
            Some((host, port)) => {
                (host, port.parse().map_err(|_| ReceiverError::Malformed(format!("{port:?} is not a port")))?)
            }
            None => (server, PORT),
        };
        if host.is_empty() || host.contains('@') {
            return Err(ReceiverError::Missing("host"));
        }
        Ok(Self {
            address: address.to_owned(),
            host: host.to_owned(),
            port,
            topic: topic.to_owned(),
            patience,
        })
    }
}

impl Receiver for Topic {
    fn address(&self) -> &str {
        &self.address
    }

    fn name(&self) -> String {
        self.host.clone()
    }

    fn tell(&self, body: &str) -> Result<(), String> {
        let mut options = MqttOptions::new(format!("trueline-{}", std::process::id()), &self.host, self.port);
        options.set_keep_alive(self.patience);
        let (client, mut connection) = Client::new(options, 4);
        // Whoever subscribes later learns the last state as well.
        client.publish(&self.topic, QoS::AtLeastOnce, true, body).map_err(|error| error.to_string())?;
        let end = Instant::now() + self.patience;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match connection.recv_timeout(left) {
                Ok(Ok(Event::Incoming(Packet::PubAck(_)))) => {
                    let _gone_already = client.disconnect();
                    return Ok(());
                }
                Ok(Ok(_)) => {}
                Ok(Err(error)) => return Err(error.to_string()),
                Err(_) => return Err("the broker did not acknowledge in time".to_owned()),
            }
        }
    }
}
