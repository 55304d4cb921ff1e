//! Answers to a KUKA controller that waits for them: of zero corrections alone, once, in time, and only where all is well.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use proptest::prelude::*;
use std::collections::BTreeSet;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};
use trueline_geometry::Pose;
use trueline_live::kuka::ethernet_config::ConfigError;
use trueline_live::kuka::rsi_sim::{self, RsiController};
use trueline_live::kuka::zero_answer::NoAnswer;
use trueline_live::kuka::{EthernetConfig, Rsi, ZeroAnswer};
use trueline_live::udp_source::DatagramProtocol;
use trueline_live::{FrameFilter, HostClock, LinkAddress, LinkError, LinkOptions, Protocol};

const CONFIG: &str = r#"<ROOT>
  <CONFIG>
    <IP_NUMBER>192.168.1.10</IP_NUMBER>
    <PORT>49152</PORT> <!-- <PORT>1</PORT> -->
    <SENTYPE>ImFree</SENTYPE>
    <ONLYSEND>FALSE</ONLYSEND>
  </CONFIG>
  <SEND><ELEMENTS><ELEMENT TAG="DEF_RIst" TYPE="DOUBLE" INDX="INTERNAL" /></ELEMENTS></SEND>
  <RECEIVE><ELEMENTS>
    <ELEMENT TAG="RKorr.X" TYPE="DOUBLE" INDX="1" HOLDON="1" />
    <ELEMENT TAG="RKorr.C" TYPE="DOUBLE" INDX="2" HOLDON="1" />
    <ELEMENT TAG="AK.A1" TYPE="DOUBLE" INDX="3" HOLDON="0" />
    <ELEMENT TAG="DiO" TYPE="LONG" INDX="4" HOLDON="1" />
    <ELEMENT TAG="RKorr.Y&quot;/&gt;" TYPE="DOUBLE" INDX="5" HOLDON="1" />
  </ELEMENTS></RECEIVE>
</ROOT>"#;

fn zero() -> ZeroAnswer {
    ZeroAnswer::of(&EthernetConfig::read(CONFIG).unwrap(), 49152).unwrap()
}

fn robot() -> SocketAddr {
    "192.168.1.20:40001".parse().unwrap()
}

fn message(ipoc: u64) -> Vec<u8> {
    rsi_sim::message(&Pose::identity(), ipoc, false, 0).into_bytes()
}

/// A PC that hears datagrams in virtual time.
struct Pc {
    rsi: Rsi,
    filter: FrameFilter,
}

impl Pc {
    fn new() -> Self {
        Self { rsi: Rsi::new(None, Some(zero())), filter: FrameFilter::new(Some(robot().ip())) }
    }

    fn hear(&mut self, bytes: &[u8], from: SocketAddr, at_ns: i64) {
        let judged = self.filter.judge_as(bytes, from, at_ns, |bytes| self.rsi.decode(bytes));
        if let Ok((raw, status)) = judged {
            self.rsi.notice(bytes, at_ns);
            self.rsi.place(raw, status);
        }
    }

    fn answer(&mut self, at_ns: i64) -> Option<String> {
        self.rsi.answer(at_ns).map(|bytes| String::from_utf8(bytes).unwrap())
    }
}

/// The count of an answer, which is nothing else but zeros: read by cutting, not by our reader.
fn ipoc_of(answer: &str) -> String {
    let rest = answer
        .strip_prefix("<Sen Type=\"ImFree\"><RKorr X=\"0.0\" C=\"0.0\"/><AK A1=\"0.0\"/><IPOC>")
        .unwrap();
    let ipoc = rest.strip_suffix("</IPOC></Sen>").unwrap();
    assert!(!ipoc.is_empty() && ipoc.bytes().all(|byte| byte.is_ascii_digit()), "{answer}");
    ipoc.to_owned()
}

const MS: i64 = 1_000_000;

#[test]
fn every_message_is_answered_once_with_its_count_and_zeros() {
    let mut pc = Pc::new();
    for k in 0..1000_u64 {
        let (ipoc, at_ns) = (4_294_966_000 + 4 * k, 4 * MS * k as i64);
        pc.hear(&message(ipoc), robot(), at_ns);
        assert_eq!(ipoc_of(&pc.answer(at_ns + MS / 10).unwrap()), ipoc.to_string());
        assert_eq!(pc.answer(at_ns + MS / 5), None, "once");
        // A datagram that came twice.
        pc.hear(&message(ipoc), robot(), at_ns + MS);
        assert_eq!(pc.answer(at_ns + MS), None);
    }
    let notes = pc.rsi.about().notes;
    assert!(notes[0].contains("1000 messages answered, all with zero corrections"), "{notes:?}");
    assert!(notes[1].contains("DiO") && notes.len() == 2, "{notes:?}");
}

#[test]
fn of_a_backlog_the_newest_is_answered_and_what_is_too_old_is_not() {
    let mut pc = Pc::new();
    for k in 0..5_u64 {
        pc.hear(&message(1000 + 4 * k), robot(), 4 * MS * k as i64);
    }
    assert_eq!(ipoc_of(&pc.answer(17 * MS).unwrap()), "1016");
    // A message overtaken on its way: it is a good pose, but no longer answered.
    pc.hear(&message(1024), robot(), 24 * MS);
    pc.hear(&message(1020), robot(), 25 * MS);
    assert_eq!(ipoc_of(&pc.answer(25 * MS).unwrap()), "1024");
    // Held up in this PC for longer than the longest cycle.
    pc.hear(&message(1028), robot(), 28 * MS);
    assert_eq!(pc.answer(28 * MS + 12 * MS + 1), None);
    pc.hear(&message(1032), robot(), 41 * MS);
    assert_eq!(ipoc_of(&pc.answer(41 * MS).unwrap()), "1032");
    let notes = pc.rsi.about().notes;
    assert!(
        notes[2].contains("4 messages were not answered because a newer one was there, 1 because"),
        "{notes:?}"
    );
}

#[test]
fn who_is_not_the_robot_or_says_what_is_in_doubt_is_not_answered() {
    let mut pc = Pc::new();
    pc.hear(&message(1000), "192.168.1.99:40001".parse().unwrap(), 0);
    assert_eq!(pc.answer(0), None, "another address");
    pc.hear(&message(1000), robot(), 0);
    assert_eq!(ipoc_of(&pc.answer(0).unwrap()), "1000");
    pc.hear(&message(1004), "192.168.1.20:40002".parse().unwrap(), 4 * MS);
    assert_eq!(pc.answer(4 * MS), None, "another port of the robot while it speaks");
    let good = String::from_utf8(message(1004)).unwrap();
    for odd in [
        good.replace("<IPOC>", "<IPOC>+"),
        good.replace("<IPOC>1004", "<IPOC>1004</IPOC><IPOC>1005"),
        good.replace("<IPOC>1004", "<IPOC>1004<Other/>1005"),
        good.replace("<IPOC>1004", "<IPOC>1004&lt;RKorr X='9'/&gt;"),
        good.replace("<IPOC>1004", "<IPOC><![CDATA[1004]]>"),
        good.replace("<IPOC>1004", "<IPOC>\u{0661}\u{0660}"),
        good.replace("<IPOC>1004", "<IPOC>99999999999999999999"),
        good.replace("X=\"0.0000\"", "X=\"nan\""),
        good.replace("<RIst", "<RIst X=\"1\""),
        good.replace("RIst", "RSol"),
        good.replace("<Rob ", "<!DOCTYPE a [<!ENTITY b 'c'>]><Rob "),
        good.replace("</Rob>", ""),
        good.replace("<Rob Type=\"KUKA\">", "<Sen Type=\"ImFree\">").replace("</Rob>", "</Sen>"),
        format!("{good}{good}"),
        format!("{}{good}", "<a>".repeat(400)),
        format!("{good}{}", " ".repeat(3000)),
        // Far ahead of what can have been lost without a silence, and behind what can be late.
        good.replace("1004", "90000000"),
        good.replace("1004", "12"),
    ] {
        pc.hear(odd.as_bytes(), robot(), 8 * MS);
        assert_eq!(pc.answer(8 * MS), None, "{}", &odd[..odd.len().min(200)]);
    }
    pc.hear(good.replace("1004", "0001004").as_bytes(), robot(), 9 * MS);
    assert_eq!(ipoc_of(&pc.answer(9 * MS).unwrap()), "0001004", "digit by digit");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// For any messages in any order, an answer is zeros and the count of a received message of the robot, and no count is
    /// answered twice.
    #[test]
    fn no_stream_of_odd_messages_is_answered_with_anything_else(
        steps in prop::collection::vec((0_u64..60, any::<u16>(), any::<u8>(), 0_u8..12), 1..120),
    ) {
        let mut pc = Pc::new();
        let (mut answered, mut sent) = (BTreeSet::new(), BTreeSet::new());
        for (k, (ahead, place, byte, kind)) in steps.iter().enumerate() {
            let ipoc = 1000 + 4 * k as u64 + ahead;
            let mut bytes = message(ipoc);
            let at = usize::from(*place) % bytes.len();
            match kind {
                0 => bytes[at] = *byte,
                1 => bytes.truncate(at),
                2 => bytes.insert(at, *byte),
                3 => drop(bytes.splice(at..at, *b"<RKorr X=\"5\"/>")),
                4 => drop(bytes.splice(at..at, *b"</IPOC><IPOC>7")),
                _ => {}
            }
            let at_ns = MS * k as i64;
            pc.hear(&bytes, robot(), at_ns);
            // The digits of any count in it.
            let text = String::from_utf8_lossy(&bytes).into_owned();
            sent.extend(text.split("IPOC").map(|part| part.trim_matches(|c: char| !c.is_ascii_digit()).to_owned()));
            if kind % 3 != 2 && let Some(answer) = pc.answer(at_ns + MS / 10) {
                let ipoc = ipoc_of(&answer);
                prop_assert!(sent.contains(&ipoc), "{ipoc} was never sent");
                prop_assert!(answered.insert(ipoc.parse::<u64>().unwrap()), "{ipoc} was answered twice");
            }
        }
    }
}

#[test]
fn a_configuration_says_whether_and_how_it_is_answered() {
    let config = EthernetConfig::read(CONFIG).unwrap();
    assert_eq!((config.port, config.sentype.as_str(), config.only_sends), (49152, "ImFree", false));
    assert_eq!(ZeroAnswer::of(&config, 49153), Err(NoAnswer::Port { configured: 49152, bound: 49153 }));
    let only_sends = EthernetConfig::read(&CONFIG.replace("FALSE", "TRUE")).unwrap();
    assert_eq!(ZeroAnswer::of(&only_sends, 49152), Err(NoAnswer::OnlySends));
    // KUKA's default.
    assert!(!EthernetConfig::read(&CONFIG.replace("<ONLYSEND>FALSE</ONLYSEND>", "")).unwrap().only_sends);
    for (text, wanted) in [
        (CONFIG.replace("<PORT>49152</PORT>", ""), ConfigError::Missing("PORT")),
        (CONFIG.replace("SENTYPE", "SENDTYPE"), ConfigError::Missing("SENTYPE")),
        (CONFIG.replace("49152", "70000"), ConfigError::Odd { name: "PORT", text: "70000".to_owned() }),
        (CONFIG.replace("FALSE", "MAYBE"), ConfigError::Odd { name: "ONLYSEND", text: "MAYBE".to_owned() }),
        (CONFIG.replace("ImFree", "a\"b"), ConfigError::Odd { name: "SENTYPE", text: "a\"b".to_owned() }),
        (CONFIG.replace("</ROOT>", ""), ConfigError::NoConfig),
        ("not at all".to_owned(), ConfigError::Missing("PORT")),
    ] {
        assert_eq!(EthernetConfig::read(&text).unwrap_err(), wanted);
    }
}

#[test]
fn only_a_named_kuka_is_answered_and_only_by_consent() {
    let answer = Some(EthernetConfig::read(CONFIG).unwrap());
    let options = LinkOptions { inputs: None, answer };
    let bind = Some("127.0.0.1:49152".parse().unwrap());
    let kuka = LinkAddress { protocol: Protocol::KukaRsi, bind, robot: None, robot_port: None };
    assert!(matches!(options.check(&kuka), Err(LinkError::AnswerWithoutRobot)));
    let named = LinkAddress { robot: Some(robot().ip()), ..kuka };
    options.check(&named).unwrap();
    let fanuc = LinkAddress { protocol: Protocol::FanucHspo, ..named };
    assert!(matches!(options.check(&fanuc), Err(LinkError::AnswerNotNeeded)));
    let inputs = |name: &str| LinkOptions { inputs: Some(name.to_owned()), answer: None };
    assert!(matches!(inputs("DI1").check(&fanuc), Err(LinkError::InputsNotNeeded)));
    assert!(matches!(inputs("a b").check(&named), Err(LinkError::Inputs(_))));
    inputs("DiL").check(&named).unwrap();
    // Without consent nothing is ever sent.
    let mut silent = Rsi::default();
    let judged =
        FrameFilter::new(None).judge_as(&message(4), robot(), 0, |bytes| silent.decode(bytes)).unwrap();
    silent.place(judged.0, judged.1);
    assert!(silent.answer(0).is_none() && !silent.must_answer());
}

/// Over real sockets, with a controller that stops when answers are missing. The cycle is 12 ms, for a busy machine. The
/// test is that answers come once, and the effect on a robot if the PC falls silent.
#[test]
fn a_controller_that_waits_is_answered_over_sockets_until_the_pc_ends() {
    let controller = UdpSocket::bind("127.0.0.1:0").unwrap();
    controller.set_read_timeout(Some(Duration::from_millis(12))).unwrap();
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut config = EthernetConfig::read(CONFIG).unwrap();
    config.port = port;
    let bind: SocketAddr = ([127, 0, 0, 1], port).into();
    let address = LinkAddress {
        protocol: Protocol::KukaRsi,
        bind: Some(bind),
        robot: Some(bind.ip()),
        robot_port: None,
    };
    let options = LinkOptions { inputs: None, answer: Some(config) };
    let mut link = address.open_with(&options, HostClock::start()).unwrap();
    let pc = std::thread::spawn(move || {
        let (began, mut poses, mut answers) = (Instant::now(), 0, Vec::new());
        while poses < 100 && began.elapsed() < Duration::from_secs(20) {
            link.receive(Duration::from_millis(20), &mut |_| poses += 1).unwrap();
            answers.extend(link.take_answers());
        }
        (poses, answers, link.about())
    });
    let mut rsi = RsiController::awaiting("ImFree".to_owned(), 100);
    let mut sent = 0;
    let mut bytes = [0; 2048];
    // The PC ends after a hundred; then the controller goes on for as long as it waits.
    while let Some(message) = rsi.message(&Pose::identity(), 1000 + 12 * sent, false) {
        controller.send_to(message.as_bytes(), bind).unwrap();
        sent += 1;
        let until = Instant::now() + Duration::from_millis(12);
        while let Ok((length, _)) = controller.recv_from(&mut bytes) {
            rsi.receive(&bytes[..length]);
            if Instant::now() > until {
                break;
            }
        }
        std::thread::sleep(until.saturating_duration_since(Instant::now()));
    }
    let (poses, answers, about) = pc.join().unwrap();
    let counts = rsi.answers().unwrap();
    assert_eq!(poses, 100);
    assert_eq!(counts.in_time + counts.refused, answers.len() as u64, "{counts:?}");
    // The machine may hold up a few.
    assert!(counts.in_time > 80 && counts.corrections == 0 && counts.stopped, "{counts:?}");
    assert!(answers.iter().all(|answer| !ipoc_of(std::str::from_utf8(&answer.bytes).unwrap()).is_empty()));
    assert!(about.protocol.contains("answering with zero corrections"), "{}", about.protocol);
}
