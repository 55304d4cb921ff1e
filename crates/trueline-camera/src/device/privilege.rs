//! Who may change anything: one program at a time, as long as it shows life.

use std::net::SocketAddr;
use std::time::{Duration, Instant};
use telegenic::gige::proto::bootstrap::{CCP_CONTROL, CCP_EXCLUSIVE};

/// The program in control.
#[derive(Clone, Copy, Debug)]
struct Owner {
    address: SocketAddr,
    exclusive: bool,
    heard: Instant,
}

/// Who is in control.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Privilege {
    owner: Option<Owner>,
}

impl Privilege {
    /// Notes a sign of life.
    pub(super) fn hear(&mut self, from: SocketAddr, now: Instant) {
        if let Some(owner) = &mut self.owner
            && owner.address == from
        {
            owner.heard = now;
        }
    }

    /// Whether it may read.
    pub(crate) fn may_read(&self, from: SocketAddr) -> bool {
        self.owner.is_none_or(|owner| owner.address == from || !owner.exclusive)
    }

    /// Whether it may change a register other than the privilege itself.
    pub(crate) fn may_write(&self, from: SocketAddr) -> bool {
        self.owner.is_some_and(|owner| owner.address == from)
    }

    /// Takes or gives back control by a value for the register; `false` if another program has it.
    pub(super) fn claim(&mut self, from: SocketAddr, value: u32, now: Instant) -> bool {
        if self.owner.is_some_and(|owner| owner.address != from) {
            return false;
        }
        let wants = value & (CCP_CONTROL | CCP_EXCLUSIVE) != 0;
        let exclusive = value & CCP_EXCLUSIVE != 0;
        self.owner = wants.then_some(Owner { address: from, exclusive, heard: now });
        true
    }

    /// Takes control away from a program that was silent for too long; `true` if it was.
    pub(crate) fn expire(&mut self, now: Instant, timeout: Duration) -> bool {
        let silent = self.owner.is_some_and(|owner| now.duration_since(owner.heard) > timeout);
        if silent {
            self.owner = None;
        }
        silent
    }

    /// Whether it is free.
    pub(crate) fn is_free(&self) -> bool {
        self.owner.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_program_has_control_until_it_gives_it_back_or_falls_silent() {
        let [one, two]: [SocketAddr; 2] =
            ["127.0.0.1:1000".parse().unwrap(), "127.0.0.1:2000".parse().unwrap()];
        let (now, timeout) = (Instant::now(), Duration::from_secs(1));
        let mut privilege = Privilege::default();
        assert!(!privilege.may_write(one) && privilege.may_read(one));
        assert!(privilege.claim(one, CCP_CONTROL, now) && privilege.may_write(one));
        assert!(!privilege.claim(two, CCP_CONTROL, now) && !privilege.may_write(two));
        assert!(privilege.may_read(two) && privilege.claim(one, CCP_EXCLUSIVE, now));
        assert!(!privilege.may_read(two));
        assert!(privilege.claim(one, 0, now) && privilege.is_free());
        assert!(privilege.claim(two, CCP_CONTROL, now));
        privilege.hear(two, now + timeout);
        assert!(!privilege.expire(now + timeout * 2, timeout));
        assert!(privilege.expire(now + timeout * 3, timeout) && privilege.is_free());
    }
}
