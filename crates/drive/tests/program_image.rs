//! The form of a program image, and what is seen of a damaged one.

use drive::program::{Failure, IMAGE_HEADER, ImageHeader, Version, VersionError, check_image};

fn image(body: &[u8]) -> Vec<u8> {
    let version = Version::new("1.2 (test)").unwrap();
    let mut image = ImageHeader::of(0x5033, version, body).bytes().to_vec();
    image.extend(body);
    image
}

/// Byte for byte; the checksum by the reference form of CRC-32 (ISO HDLC).
#[test]
fn layout() {
    let mut crc = u32::MAX;
    let image = image(b"program");
    for byte in &image[8..] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
        }
    }
    let mut expected = b"SBI1".to_vec();
    expected.extend((!crc).to_le_bytes());
    expected.extend([7, 0, 0, 0, 0x33, 0x50, 0, 0]);
    expected.extend(b"1.2 (test)");
    expected.resize(IMAGE_HEADER, 0);
    expected.extend(b"program");
    assert_eq!(image, expected);
    let header = check_image(&image).unwrap();
    assert_eq!(
        (header.body_bytes, header.image_bytes(), header.product),
        (7, 71, 0x5033)
    );
    assert_eq!(header.version.text(), "1.2 (test)");
    assert_eq!(header.checksum, !crc);
}

#[test]
fn every_flipped_bit_and_every_wrong_length_is_seen() {
    let whole = image(b"program");
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let failure = check_image(&flipped).unwrap_err();
        let expected = match bit / 8 {
            0..4 => matches!(failure, Failure::NotAnImage),
            // A length of no bytes is none.
            8..12 => matches!(
                failure,
                Failure::TooLong { .. } | Failure::TooShort { .. } | Failure::NotAnImage
            ),
            _ => matches!(failure, Failure::Checksum { .. }),
        };
        assert!(expected, "bit {bit}: {failure}");
    }
    for length in 0..whole.len() {
        let failure = check_image(&whole[..length]).unwrap_err();
        let expected = if length < 64 { 64 } else { 71 };
        let received = length as u32;
        assert_eq!(failure, Failure::TooShort { expected, received });
    }
    let longer = [&whole[..], &[0]].concat();
    assert_eq!(check_image(&longer), Err(Failure::TooLong { expected: 71 }));
    assert_eq!(check_image(&image(b"")), Err(Failure::NotAnImage));
}

#[test]
fn versions() {
    let long = "0123456789abcdef0123456789abcdef";
    assert_eq!(Version::new(long).unwrap().text(), long);
    assert_eq!(Version::new("1.0-β").unwrap().text(), "1.0-β");
    assert_eq!(
        Version::new(&long.replace('0', "00")),
        Err(VersionError::TooLong { bytes: 34 })
    );
    for text in ["", "a\nb", "a\0"] {
        assert_eq!(Version::new(text), Err(VersionError::NotText));
    }
    // Bytes that are no text, as another tool might write.
    let mut raw = image(b"program");
    raw[16..20].copy_from_slice(b"1.2\xFF");
    let header = ImageHeader::parse(raw.first_chunk().unwrap()).unwrap();
    assert_eq!(header.version.text(), "1.2");
}
