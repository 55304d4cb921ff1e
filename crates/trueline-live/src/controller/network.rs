//! A network that delays, loses, repeats and overtakes.

use rand::Rng;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Effect of a network path on datagrams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkSettings {
    /// Delay of every datagram, s.
    pub least_s: f64,
    /// Mean of an exponential delay on top, s.
    pub tail_s: f64,
    /// Share that is held up by 0.5 to 8 ms.
    pub held_up: f64,
    /// Share that is lost.
    pub loss: f64,
    /// Mean number of losses in a row: 1 loses each independently, an overloaded switch loses many (Gilbert's model).
    pub burst: f64,
    /// Share that comes twice.
    pub duplicate: f64,
    /// Share that is overtaken by the next one.
    pub reorder: f64,
}

impl NetworkSettings {
    /// A cable and a switch.
    #[must_use]
    pub fn typical() -> Self {
        Self {
            least_s: 2e-4,
            tail_s: 5e-5,
            held_up: 0.01,
            loss: 1e-4,
            burst: 1.0,
            duplicate: 0.0,
            reorder: 0.0,
        }
    }

    /// Nothing in between.
    #[must_use]
    pub fn none() -> Self {
        Self { least_s: 0.0, tail_s: 0.0, held_up: 0.0, loss: 0.0, burst: 1.0, duplicate: 0.0, reorder: 0.0 }
    }
}

/// Delay that lets the next datagram pass, s.
const OVERTAKEN_S: f64 = 0.006;

/// One direction of the network and its messages under way.
#[derive(Clone, Debug)]
pub struct Network<T: Ord> {
    settings: NetworkSettings,
    rng: ChaCha8Rng,
    /// By due time, ns, then by order of sending.
    under_way: BinaryHeap<Reverse<(i64, u64, T)>>,
    sent: u64,
    lost: u64,
    in_burst: bool,
}

impl<T: Ord + Clone> Network<T> {
    /// An empty way.
    #[must_use]
    pub fn new(settings: NetworkSettings, seed: u64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Self { settings, rng, under_way: BinaryHeap::new(), sent: 0, lost: 0, in_burst: false }
    }

    /// Datagrams that were lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Puts something on its way.
    pub fn send(&mut self, now_ns: i64, what: T) {
        if self.is_lost() {
            self.lost += 1;
            return;
        }
        let copies = if self.rng.random_bool(self.settings.duplicate) { 2 } else { 1 };
        for _ in 0..copies {
            let due_ns = now_ns + (self.delay_s() * 1e9).round() as i64;
            self.under_way.push(Reverse((due_ns, self.sent, what.clone())));
            self.sent += 1;
        }
    }

    /// A burst continues with 1 − 1/burst; it begins so that the share of all losses is right.
    fn is_lost(&mut self) -> bool {
        let NetworkSettings { loss, burst, .. } = self.settings;
        let ends = 1.0 / burst.max(1.0);
        let begins = loss * ends / (1.0 - loss + loss * ends);
        let chance = match self.in_burst {
            // The next one is the first after the burst, or begins another.
            true => (1.0 - ends) + ends * begins,
            false => begins,
        };
        self.in_burst = self.rng.random_bool(chance);
        self.in_burst
    }

    fn delay_s(&mut self) -> f64 {
        let tail: f64 = Exp1.sample(&mut self.rng);
        let mut delay_s = self.settings.least_s + self.settings.tail_s * tail;
        if self.rng.random_bool(self.settings.held_up) {
            delay_s += self.rng.random_range(0.0005..0.008);
        }
        if self.rng.random_bool(self.settings.reorder) {
            delay_s += OVERTAKEN_S;
        }
        delay_s
    }

    /// When the next one is due, ns.
    #[must_use]
    pub(crate) fn next_due_ns(&self) -> Option<i64> {
        self.under_way.peek().map(|Reverse((due_ns, _, _))| *due_ns)
    }

    /// Takes one that is due by now, with the time it was due.
    pub fn take_due(&mut self, now_ns: i64) -> Option<(i64, T)> {
        if self.next_due_ns()? > now_ns {
            return None;
        }
        self.under_way.pop().map(|Reverse((due_ns, _, what))| (due_ns, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_have_their_share_and_their_length() {
        for (loss, burst) in [(0.01, 1.0), (0.05, 1.0), (0.01, 8.0), (0.2, 20.0)] {
            let mut network = Network::new(NetworkSettings { loss, burst, ..NetworkSettings::none() }, 7);
            let (mut bursts, mut was_lost, sent) = (0_u64, false, 400_000);
            for k in 0..sent {
                let before = network.lost();
                network.send(k, k);
                let lost = network.lost() > before;
                bursts += u64::from(lost && !was_lost);
                was_lost = lost;
            }
            let share = network.lost() as f64 / sent as f64;
            let length = network.lost() as f64 / bursts as f64;
            // By chance √(2·burst/(loss·sent)) of each: 3 % at most; thrice that. A burst that follows at once lengthens the one before.
            assert!((share / loss - 1.0).abs() < 0.1, "{share} is not {loss}");
            assert!((length / burst - 1.0).abs() < 0.16, "{length} is not {burst}");
        }
    }
}
