//! Recordings, read back by other people's code.

use bus::ErrorFrame;
use bus::recording::{Content, Direction, Recorder, candump};
use can::{ExtendedId, Frame, Id, StandardId};
use mcap::read::Options;
use pcap_parser::Linktype;
use pcap_parser::pcapng::{Block, OptionCode, parse_block_le};
use pcap_parser::traits::PcapNGPacketBlock;
use std::fs;
use std::path::{Path, PathBuf};

/// A time that needs more than 32 bits and all its nanoseconds.
const BEGIN_NS: u64 = 1_795_633_598_459_957_003;

type Entry = (u64, Content, Option<Direction>);

/// Every kind of frame, and an error frame.
fn entries() -> Vec<Entry> {
    let standard: Id = StandardId::new(0x601).unwrap().into();
    let extended: Id = ExtendedId::new(0x1ABC_DEF0).unwrap().into();
    let frames = [
        Frame::data_frame(standard, &[]),
        Frame::data_frame(standard, &[0x40, 0x41, 0x60, 0, 1, 2, 3, 0xFF]),
        Frame::data_frame(extended, &[0xAB, 0xCD, 0xEF]),
        Frame::remote_frame(standard, 0),
        Frame::remote_frame(extended, 8),
    ];
    let mut contents: Vec<Content> = frames.map(|frame| Content::Frame(frame.unwrap())).into();
    contents.push(Content::Error(ErrorFrame {
        class: 0x204,
        data: [0, 8, 0, 0, 0, 0, 96, 8],
    }));
    let directions = [Some(Direction::Sent), Some(Direction::Received), None];
    (0..)
        .zip(contents)
        .map(|(n, content)| (BEGIN_NS + n * 1_001, content, directions[n as usize % 3]))
        .collect()
}

/// A file of its own, removed at the end.
struct File(PathBuf);

impl File {
    fn new(name: &str) -> File {
        let name = format!("servobus-recording-{}-{name}", std::process::id());
        File(std::env::temp_dir().join(name))
    }

    fn recorder(&self) -> Recorder {
        Recorder::create(&self.0, "can7").unwrap()
    }

    fn bytes(&self) -> Vec<u8> {
        fs::read(&self.0).unwrap()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// All entries, a note before the third and one behind the last.
fn record(file: &File) {
    let mut recorder = file.recorder();
    for (number, (stamp_ns, content, direction)) in entries().into_iter().enumerate() {
        if number == 2 {
            recorder.note(stamp_ns, "node 1: bus-off").unwrap();
        }
        recorder.write(stamp_ns, &content, direction).unwrap();
    }
    recorder.note(BEGIN_NS, "the end").unwrap();
    recorder.finish(BEGIN_NS + 1_000_000).unwrap();
}

/// Time stamp, packet, comment, direction.
type Packet = (u64, Vec<u8>, Option<String>, Option<u32>);

#[derive(Debug, Default, PartialEq)]
struct Captured {
    packets: Vec<Packet>,
    last_comment: Option<String>,
    counted: Option<u64>,
    cut_off: bool,
}

/// What pcap-parser finds.
fn read_pcapng(mut bytes: &[u8]) -> Captured {
    let mut captured = Captured::default();
    while !bytes.is_empty() {
        let Ok((rest, block)) = parse_block_le(bytes) else {
            captured.cut_off = true;
            break;
        };
        captured.take(&block);
        bytes = rest;
    }
    captured
}

impl Captured {
    fn take(&mut self, block: &Block<'_>) {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        match block {
            Block::SectionHeader(section) => assert_eq!(section.major_version, 1),
            Block::InterfaceDescription(interface) => {
                assert_eq!(interface.linktype, Linktype(227));
                assert_eq!(interface.if_tsresol, 9);
                let mut options = interface.options.iter();
                let name = options.find(|option| option.code == OptionCode::IfName);
                assert_eq!(name.unwrap().value(), b"can7");
            }
            Block::EnhancedPacket(packet) => {
                let stamp = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
                assert_eq!((packet.if_id, packet.caplen, packet.origlen), (0, 16, 16));
                let find = |code| packet.options.iter().find(|option| option.code == code);
                let comment = find(OptionCode::Comment);
                let comment = comment.map(|option| text(&option.value[..option.len.into()]));
                // epb_flags is 2, which pcap-parser calls by the interface's name for that number.
                let flags = packet.options.iter().find(|option| option.code.0 == 2);
                let flags =
                    flags.map(|option| u32::from_le_bytes(option.value[..4].try_into().unwrap()));
                self.packets
                    .push((stamp, packet.packet_data().to_vec(), comment, flags));
            }
            Block::InterfaceStatistics(statistics) => {
                for option in &statistics.options {
                    match option.code.0 {
                        1 => self.last_comment = Some(text(&option.value[..option.len.into()])),
                        4 => {
                            let count = option.value[..8].try_into().unwrap();
                            self.counted = Some(u64::from_le_bytes(count));
                        }
                        _ => {}
                    }
                }
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn pcapng_is_read_by_pcap_parser() {
    let file = File::new("whole.pcapng");
    record(&file);
    let captured = read_pcapng(&file.bytes());
    let packets: [[u8; 16]; 6] = [
        [0, 0, 6, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        [0, 0, 6, 1, 8, 0, 0, 0, 0x40, 0x41, 0x60, 0, 1, 2, 3, 0xFF],
        [
            0x9A, 0xBC, 0xDE, 0xF0, 3, 0, 0, 0, 0xAB, 0xCD, 0xEF, 0, 0, 0, 0, 0,
        ],
        [0x40, 0, 6, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        [0xDA, 0xBC, 0xDE, 0xF0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        [0x20, 0, 2, 4, 8, 0, 0, 0, 0, 8, 0, 0, 0, 0, 96, 8],
    ];
    let flags = [Some(0b10), Some(0b01), None];
    let expected: Vec<_> = (0..)
        .zip(packets)
        .map(|(n, packet)| {
            let comment = (n == 2).then(|| "node 1: bus-off".to_owned());
            let stamp = BEGIN_NS + n * 1_001;
            (stamp, packet.to_vec(), comment, flags[n as usize % 3])
        })
        .collect();
    assert_eq!(captured.packets, expected);
    assert_eq!(captured.last_comment.as_deref(), Some("the end"));
    assert_eq!((captured.counted, captured.cut_off), (Some(6), false));
}

/// Wherever it is cut off, what stands whole before is read.
#[test]
fn pcapng_that_was_cut_off_is_read_up_to_the_cut() {
    let file = File::new("cut.pcapng");
    record(&file);
    let bytes = file.bytes();
    let whole = read_pcapng(&bytes).packets;
    let mut most = 0;
    for end in 0..bytes.len() {
        let cut = read_pcapng(&bytes[..end]).packets;
        assert_eq!(cut, whole[..cut.len()], "cut at {end}");
        assert!(cut.len() >= most);
        most = cut.len();
    }
    // What was cut last is the statistics.
    assert_eq!(most, whole.len());
}

/// A message: topic, time, JSON.
type Message = (String, u64, serde_json::Value);

fn read_mcap(bytes: &[u8]) -> Vec<Message> {
    let stream = mcap::MessageStream::new_with_options(
        bytes,
        Options::IgnoreEndMagic | Options::ValidateChunkCrcs,
    );
    let message = |message: mcap::Message<'_>| {
        let channel = &message.channel;
        assert_eq!(channel.message_encoding, "json");
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!(schema.encoding, "jsonschema");
        let schema: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
        let content: serde_json::Value = serde_json::from_slice(&message.data).unwrap();
        // The schema names what is in it.
        for name in content.as_object().unwrap().keys() {
            assert!(schema["properties"][name].is_object(), "{name}");
        }
        assert_eq!(message.log_time, message.publish_time);
        (channel.topic.clone(), message.log_time, content)
    };
    // A file that was cut off ends with an error.
    stream.unwrap().map_while(Result::ok).map(message).collect()
}

#[test]
fn mcap_is_read_by_its_own_crate() {
    let file = File::new("whole.mcap");
    record(&file);
    let bytes = file.bytes();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 8);
    let messages = read_mcap(&bytes);
    let frames: Vec<&Message> = messages.iter().filter(|(t, ..)| t == "can7").collect();
    let expected = [
        r#"{"id":1537,"extended":false,"remote":false,"error":false,"length":0,"data":[],"direction":"sent"}"#,
        r#"{"id":1537,"extended":false,"remote":false,"error":false,"length":8,"data":[64,65,96,0,1,2,3,255],"direction":"received"}"#,
        r#"{"id":448585456,"extended":true,"remote":false,"error":false,"length":3,"data":[171,205,239],"direction":null}"#,
        r#"{"id":1537,"extended":false,"remote":true,"error":false,"length":0,"data":[],"direction":"sent"}"#,
        r#"{"id":448585456,"extended":true,"remote":true,"error":false,"length":8,"data":[],"direction":"received"}"#,
        r#"{"id":516,"extended":false,"remote":false,"error":true,"length":8,"data":[0,8,0,0,0,0,96,8],"direction":null}"#,
    ];
    assert_eq!(frames.len(), expected.len());
    for (n, (frame, expected)) in (0..).zip(frames.iter().zip(expected)) {
        let expected: serde_json::Value = serde_json::from_str(expected).unwrap();
        assert_eq!((frame.1, &frame.2), (BEGIN_NS + n * 1_001, &expected));
    }
    let notes = messages.iter().filter(|(topic, ..)| topic == "notes");
    let notes: Vec<&str> = notes
        .map(|(.., note)| note["text"].as_str().unwrap())
        .collect();
    assert_eq!(notes, ["node 1: bus-off", "the end"]);
}

/// What was flushed before the cut is there, each chunk whole or not at all.
#[test]
fn mcap_that_was_cut_off_is_read_up_to_the_last_chunk() {
    let file = File::new("cut.mcap");
    let mut recorder = file.recorder();
    assert!(recorder.takes_signals());
    let mut lengths = Vec::new();
    for (stamp_ns, content, direction) in entries() {
        recorder.write(stamp_ns, &content, direction).unwrap();
        let values = [("speed_rad_s", 1.5), ("position_turns", -2.0)];
        recorder.signals(stamp_ns, "drive/1", &values).unwrap();
        recorder.flush().unwrap();
        lengths.push(file.bytes().len());
    }
    let bytes = file.bytes();
    drop(recorder);
    let whole = read_mcap(&bytes);
    assert_eq!(whole.len(), 2 * lengths.len());
    for end in lengths[0]..bytes.len() {
        let cut = read_mcap(&bytes[..end]);
        assert_eq!(cut, whole[..cut.len()], "cut at {end}");
        let flushed = lengths.iter().filter(|length| **length <= end).count();
        // The rest of a chunk is its index, which is not needed.
        assert!((flushed..=flushed + 1).contains(&(cut.len() / 2)), "{end}");
    }
    let (topic, _, signals) = read_mcap(&bytes).pop().unwrap();
    let expected = serde_json::json!({ "speed_rad_s": 1.5, "position_turns": -2.0 });
    assert_eq!((topic.as_str(), signals), ("drive/1", expected));
}

#[test]
fn candump_is_read_by_our_own_reader() {
    let file = File::new("whole.log");
    record(&file);
    let bytes = file.bytes();
    let read: Vec<(u64, Content)> = candump::Reader::new(bytes.as_slice())
        .map(|record| record.unwrap())
        .map(|record| (record.stamp_ns, record.content))
        .collect();
    let written = entries().into_iter();
    let written: Vec<(u64, Content)> = written
        .map(|(stamp_ns, content, _)| (stamp_ns / 1_000 * 1_000, content))
        .collect();
    assert_eq!(read, written);
}

#[test]
fn an_unknown_ending_touches_nothing() {
    let path = Path::new("servobus-recording.txt");
    let error = Recorder::create(path, "can0").unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::InvalidInput);
    assert!(
        error
            .to_string()
            .contains(".log (candump), .pcapng (Wireshark) or .mcap")
    );
    assert!(!path.exists());
}
