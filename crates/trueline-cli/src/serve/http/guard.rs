//! Decides which requests are answered: those that name this PC.
//!
//! A page on the internet can make a browser inside the factory ask this server under a name of its own that points here
//! (DNS rebinding). It could read the answer as if it were its own. Such a request carries that name in its Host header. A
//! literal address cannot be rebound, and `localhost` is resolved by the browser itself; other names count only if they were
//! named.

use axum::http::{HeaderMap, Uri, header};
use std::net::{Ipv4Addr, Ipv6Addr};

/// Names of this PC in requests, besides literal addresses and `localhost`.
#[derive(Clone, Debug, Default)]
pub(super) struct HostNames(Vec<String>);

impl HostNames {
    /// These names; `Err` is the first invalid one.
    pub(super) fn new(names: &[String]) -> Result<Self, String> {
        let is_name = |name: &str| {
            let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
            !name.is_empty() && name.len() <= 253 && name.chars().all(allowed)
        };
        match names.iter().find(|name| !is_name(name)) {
            Some(wrong) => Err(wrong.clone()),
            None => Ok(Self(names.iter().map(|name| name.to_ascii_lowercase()).collect())),
        }
    }

    /// Whether a request may be answered: it needs exactly one Host, that of this PC, and the same in an absolute
    /// address.
    pub(super) fn admit(&self, headers: &HeaderMap, uri: &Uri) -> bool {
        let mut hosts = headers.get_all(header::HOST).iter();
        let (Some(host), None) = (hosts.next(), hosts.next()) else { return false };
        let own = host.to_str().is_ok_and(|host| self.is_this_pc(host));
        own && uri.authority().is_none_or(|authority| self.is_this_pc(authority.as_str()))
    }

    fn is_this_pc(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        let literal = name.parse::<Ipv4Addr>().is_ok()
            || name
                .strip_prefix('[')
                .and_then(|n| n.strip_suffix(']'))
                .is_some_and(|n| n.parse::<Ipv6Addr>().is_ok());
        let name = name.to_ascii_lowercase();
        literal || name == "localhost" || self.0.contains(&name)
    }
}

/// A host without its port; `None` if the port is invalid.
fn without_port(host: &str) -> Option<&str> {
    let end_of_name =
        if host.starts_with('[') { host.find(']')? + 1 } else { host.find(':').unwrap_or(host.len()) };
    let (name, port) = host.split_at(end_of_name);
    let is_port = port.strip_prefix(':').is_some_and(|digits| digits.parse::<u16>().is_ok());
    (port.is_empty() || is_port).then_some(name)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn admits(hosts: &[&str], uri: &str) -> bool {
        let names = HostNames::new(&["Cell-PC.example".to_owned()]).unwrap();
        let mut headers = HeaderMap::new();
        for host in hosts {
            headers.append(header::HOST, HeaderValue::from_str(host).unwrap());
        }
        names.admit(&headers, &uri.parse().unwrap())
    }

    #[test]
    fn only_this_pc_is_admitted() {
        for own in [
            "127.0.0.1",
            "127.0.0.1:8080",
            "192.168.1.7:80",
            "[::1]",
            "[::1]:8080",
            "localhost",
            "LocalHost:8080",
        ] {
            assert!(admits(&[own], "/"), "{own}");
        }
        assert!(admits(&["cell-pc.EXAMPLE:8080"], "/"), "a name that was given");
        let others = [
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "xlocalhost",
            "127.0.0.1:80:80",
            "127.0.0.1:x",
            "127.0.0.1@evil.example",
            "[::1",
            "[evil.example]",
            "",
            "0x7f.1",
            "2130706433",
            "localhost.",
        ];
        for other in others {
            assert!(!admits(&[other], "/"), "{other}");
        }
        assert!(!admits(&[], "/"), "no Host at all");
        assert!(!admits(&["localhost", "localhost"], "/"), "two of them");
        assert!(!admits(&["localhost"], "http://evil.example/"), "an absolute address counts as well");
        assert!(admits(&["localhost"], "http://localhost/"));
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for wrong in ["", "a:80", "*", "a b", "http://a"] {
            assert_eq!(HostNames::new(&[wrong.to_owned()]).unwrap_err(), wrong);
        }
    }
}
