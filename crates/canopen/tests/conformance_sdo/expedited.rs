//! Expedited transfers.

use canopen::{Abort, Address, Verdict};

use crate::harness::Call;
use crate::master::{Master, initiate, number};

const BYTE: Address = Address::new(0x2000, 1);
const WORD: Address = Address::new(0x2000, 2);
const LONG: Address = Address::new(0x2000, 3);

pub(crate) fn upload_says_its_size() {
    Master::new().play(
        "> 40 00 10 00 00 00 00 00
         < 43 00 10 00 92 01 02 00    ; four bytes
         > 40 01 20 00 00 00 00 00
         < 4B 01 20 00 34 12 00 00    ; two
         > 40 01 10 00 00 00 00 00
         < 4F 01 10 00 00 00 00 00    ; one
         > 40 11 20 02 00 00 00 00
         < 47 11 20 02 00 00 00 00    ; three: an OCTET_STRING
         > 40 0A 10 00 00 00 00 00
         < 47 0A 10 00 31 2E 30 00    ; three: 1.0
         > 40 13 20 02 00 00 00 00
         < 43 13 20 02 66 6F 75 72    ; four",
    );
}

pub(crate) fn reserved_bits_are_not_looked_at() {
    let mut master = Master::new();
    for command in 0x40..=0x5F {
        let answer = master.ask(&[command, 0x01, 0x20, 0, 0xFF, 0xFF, 0xFF, 0xFF]);
        assert_eq!(answer, [0x4B, 0x01, 0x20, 0, 0x34, 0x12, 0, 0]);
    }
}

pub(crate) fn download_of_a_size() {
    for (object, size) in [(BYTE, 1), (WORD, 2), (LONG, 4)] {
        for said in 1..=4_u32 {
            let mut master = Master::new();
            let command = 0x23 | ((4 - said) << 2) as u8;
            let answer = master.ask(&initiate(command, object, 0x4433_2211));
            let expected = match said.cmp(&size) {
                std::cmp::Ordering::Less => initiate(0x80, object, 0x0607_0013),
                std::cmp::Ordering::Equal => initiate(0x60, object, 0),
                std::cmp::Ordering::Greater => initiate(0x80, object, 0x0607_0012),
            };
            assert_eq!(answer, expected, "{object}, {said} bytes");
            let now = number(master.ask(&initiate(0x40, object, 0)));
            let taken = 0x4433_2211 & u32::MAX >> (32 - 8 * size);
            assert_eq!(now, if said == size { taken } else { 0 });
        }
    }
}

pub(crate) fn download_without_a_size() {
    for (object, taken) in [(BYTE, 0x11), (WORD, 0x2211), (LONG, 0x4433_2211)] {
        // The count bits mean nothing without the size bit.
        for command in [0x22, 0x26, 0x2A, 0x2E] {
            let mut master = Master::new();
            let answer = master.ask(&initiate(command, object, 0x4433_2211));
            assert_eq!(answer, initiate(0x60, object, 0));
            assert_eq!(number(master.ask(&initiate(0x40, object, 0))), taken);
        }
    }
    // Octets, too, are as many as their object has; a text's are not known.
    Master::new().play(
        "> 22 11 20 02 01 02 03 04
         < 60 11 20 02 00 00 00 00
         > 40 11 20 02 00 00 00 00
         < 47 11 20 02 01 02 03 00
         > 22 10 20 02 61 62 63 64
         < 80 10 20 02 10 00 07 06
         > 22 00 20 09 61 62 63 64
         < 80 00 20 09 13 00 07 06",
    );
}

pub(crate) fn texts_and_octets() {
    Master::new().play(
        "> 23 10 20 02 61 62 63 64    ; four characters into four
         < 60 10 20 02 00 00 00 00
         > 40 10 20 02 00 00 00 00
         < 43 10 20 02 61 62 63 64
         > 2F 10 20 02 7A 00 00 00    ; one: the rest is no more
         < 60 10 20 02 00 00 00 00
         > 40 10 20 02 00 00 00 00
         < 4F 10 20 02 7A 00 00 00
         > 27 10 20 01 61 62 63 00    ; three characters into 32
         < 60 10 20 01 00 00 00 00
         > 40 10 20 01 00 00 00 00
         < 47 10 20 01 61 62 63 00
         > 27 11 20 02 01 00 03 00    ; three octets into three
         < 60 11 20 02 00 00 00 00
         > 40 11 20 02 00 00 00 00
         < 47 11 20 02 01 00 03 00
         > 2B 11 20 02 01 02 00 00    ; two and four
         < 80 11 20 02 13 00 07 06
         > 23 11 20 02 01 02 03 04
         < 80 11 20 02 12 00 07 06
         > 23 00 20 09 01 02 03 04    ; an INTEGER64 has eight
         < 80 00 20 09 13 00 07 06",
    );
}

/// The value is judged before it is acknowledged, and not kept if it is refused.
pub(crate) fn the_owner_s_verdict() {
    for (verdict, answer, kept) in [
        (Verdict::Accept, 0, 0x000F),
        (Verdict::Done, 0, 0),
        (Verdict::Refuse(Abort::LOCAL_CONTROL), 0x0800_0021, 0),
    ] {
        let mut master = Master::new();
        master.bench.owner.verdict = verdict;
        let command = Address::new(0x2005, 0);
        let answered = master.ask(&initiate(0x2B, command, 0x000F));
        let first = if answer == 0 { 0x60 } else { 0x80 };
        assert_eq!(answered, initiate(first, command, answer));
        let asked = [Call::Write(command, vec![0x0F, 0x00])];
        assert_eq!(master.bench.owner.calls, asked);
        assert_eq!(number(master.ask(&initiate(0x40, command, 0))), kept);
    }
}

pub(crate) fn an_answer_that_comes_later() {
    for (result, answer) in [
        (Ok(()), "60 10 10 01 00 00 00 00"),
        (Err(Abort::HARDWARE), "80 10 10 01 00 00 06 06"),
    ] {
        let mut master = Master::new();
        master.bench.owner.verdict = Verdict::Later;
        master.play(
            "> 23 10 10 01 73 61 76 65
             ~ 30000
             > 40 01 20 00 00 00 00 00    ; reading goes on
             < 4B 01 20 00 34 12 00 00
             > 2F 0B 20 00 07 00 00 00    ; writing waits
             < 80 0B 20 00 22 00 00 08
             > 40 10 10 01 00 00 00 00
             < 43 10 10 01 01 00 00 00",
        );
        let expected: [u8; 8] = crate::master::hex(answer).try_into().expect("eight bytes");
        assert_eq!(master.complete(result), [expected]);
        assert_eq!(master.complete(result), [[0; 8]; 0], "once");
        master.bench.owner.verdict = Verdict::Accept;
        master.is_usable();
    }
}

/// Live objects are as they are at the moment of the upload.
pub(crate) fn live_values() {
    let mut master = Master::new();
    master.play(
        "> 40 08 20 00 00 00 00 00
         < 43 08 20 00 01 00 00 00
         > 40 08 20 00 00 00 00 00
         < 43 08 20 00 02 00 00 00
         > 40 16 20 00 00 00 00 00    ; an INTEGER64 takes segments
         < 41 16 20 00 08 00 00 00
         > 60 00 00 00 00 00 00 00
         < 00 FD FF FF FF FF FF FF
         > 70 00 00 00 00 00 00 00
         < 1D FF 00 00 00 00 00 00
         > 40 10 20 04 00 00 00 00    ; a text
         < 41 10 20 04 0D 00 00 00",
    );
}
