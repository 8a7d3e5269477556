//! The client's side of block transfers, with loss where a test wants it.

use canopen::Address;

use crate::master::{Master, checksum, initiate, number, segment};

/// How a block download is done.
#[derive(Clone, Copy)]
pub(crate) struct Way {
    pub(crate) with_crc: bool,
    pub(crate) say_size: bool,
}

pub(crate) const PLAIN: Way = Way {
    with_crc: true,
    say_size: true,
};

impl Master {
    /// Announces a block download and gives the server's block size.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn announce_blocks(
        &mut self,
        object: Address,
        size: usize,
        way: Way,
    ) -> Result<u8, u32> {
        let command = 0xC0 | u8::from(way.with_crc) << 2 | u8::from(way.say_size) << 1;
        let size = if way.say_size { size as u32 } else { 0 };
        let answer = self.ask(&initiate(command, object, size));
        if answer[0] == 0x80 {
            return Err(number(answer));
        }
        let block_size = answer[4];
        assert!(matches!(block_size, 1..=127));
        // Bit 2: the server knows the checksum.
        assert_eq!(answer, initiate(0xA4, object, u32::from(block_size)));
        Ok(block_size)
    }

    /// Downloads in blocks. `is_lost` says of the nth segment that is sent, over all, whether it
    /// gets lost; one that ends a block is followed by a silence then.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn download_blocks(
        &mut self,
        object: Address,
        data: &[u8],
        way: Way,
        is_lost: impl Fn(usize) -> bool,
    ) -> Result<(), u32> {
        let mut block_size = usize::from(self.announce_blocks(object, data.len(), way)?);
        let segments = data.len().div_ceil(7).max(1);
        let (mut done, mut sent) = (0, 0);
        while done < segments {
            let block = block_size.min(segments - done);
            let (mut answers, mut any) = (Vec::<[u8; 8]>::new(), false);
            for n in 1..=block {
                let at = 7 * (done + n - 1);
                let part = &data[at..data.len().min(at + 7)];
                let is_last = u8::from(done + n == segments) << 7;
                if !is_lost(sent) {
                    if let [answer] = answers[..] {
                        assert_eq!(answer[0], 0x80, "an answer within a block");
                        return Err(number(answer));
                    }
                    answers = self.send(&segment(is_last | n as u8, part));
                    any = true;
                }
                sent += 1;
            }
            if answers.is_empty() {
                answers = self.after_ms(200);
                if !any {
                    // The server cannot know that there was a block.
                    assert_eq!(answers, [[0; 8]; 0]);
                    answers = self.after_ms(1000);
                }
            }
            let &[answer] = &answers[..] else {
                panic!("after a block: {answers:02X?}");
            };
            if answer[0] == 0x80 {
                return Err(number(answer));
            }
            let [0xA2, came, next_size, 0, 0, 0, 0, 0] = answer else {
                panic!("after a block: {answer:02X?}");
            };
            assert!(usize::from(came) <= block && matches!(next_size, 1..=127));
            done += usize::from(came);
            block_size = usize::from(next_size);
        }
        let crc = if way.with_crc { checksum(data) } else { 0 };
        self.end_blocks(7 * segments - data.len(), crc)
    }

    /// Ends a block download.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn end_blocks(&mut self, unused: usize, crc: u16) -> Result<(), u32> {
        let answer = self.ask(&segment(0xC1 | (unused as u8) << 2, &crc.to_le_bytes()));
        if answer[0] == 0x80 {
            return Err(number(answer));
        }
        assert_eq!(answer, [0xA1, 0, 0, 0, 0, 0, 0, 0]);
        Ok(())
    }

    /// Uploads in blocks of as many segments as `block_size` says of the nth block. `is_lost` says
    /// of the nth segment that comes, over all, whether it gets lost.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn upload_blocks(
        &mut self,
        object: Address,
        with_crc: bool,
        block_size: impl Fn(usize) -> u8,
        is_lost: impl Fn(usize) -> bool,
    ) -> Result<Vec<u8>, u32> {
        let mut size = block_size(0);
        let command = 0xA0 | u8::from(with_crc) << 2;
        let answer = self.ask(&initiate(command, object, u32::from(size)));
        if answer[0] == 0x80 {
            return Err(number(answer));
        }
        assert_eq!(answer[1..4], initiate(0, object, 0)[1..4]);
        let said = match answer[0] {
            0xC6 => Some(number(answer) as usize),
            0xC4 => None,
            other => panic!("block upload response {other:02X}"),
        };
        let (mut data, mut came) = (Vec::new(), 0);
        let mut segments = self.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]);
        for block in 1.. {
            if let [.., end] = segments[..]
                && end[0] == 0x80
                && end[1..4] == initiate(0, object, 0)[1..4]
            {
                return Err(number(end));
            }
            let count = segments.len();
            assert!(count >= 1 && count <= usize::from(size), "{count} segments");
            let is_end = segments.last().is_some_and(|part| part[0] & 0x80 != 0);
            assert!(is_end || count == usize::from(size), "a whole block");
            let (mut in_order, mut is_over) = (0, false);
            for (n, part) in (1..).zip(&segments) {
                let is_last = part[0] & 0x80 != 0;
                assert_eq!(part[0] & 0x7F, n, "numbered from 1");
                assert!(
                    !is_last || usize::from(n) == count,
                    "nothing after the last"
                );
                if !is_lost(came) && n == in_order + 1 {
                    data.extend_from_slice(&part[1..]);
                    in_order = n;
                    is_over = is_last;
                }
                came += 1;
            }
            size = block_size(block);
            segments = self.send(&[0xA2, in_order, size, 0, 0, 0, 0, 0]);
            if is_over {
                break;
            }
        }
        let &[end] = &segments[..] else {
            panic!("after the last block: {segments:02X?}");
        };
        if end[0] == 0x80 {
            return Err(number(end));
        }
        assert_eq!(end[0] & 0xE3, 0xC1, "{end:02X?}");
        assert_eq!(end[3..], [0; 5]);
        let unused = usize::from(end[0] >> 2 & 7);
        data.truncate(data.len() - unused);
        let expected = if with_crc { checksum(&data) } else { 0 };
        assert_eq!(u16::from_le_bytes([end[1], end[2]]), expected);
        assert!(said.is_none_or(|said| said == data.len()));
        assert_eq!(self.send(&[0xA1, 0, 0, 0, 0, 0, 0, 0]), [[0; 8]; 0]);
        Ok(data)
    }
}
