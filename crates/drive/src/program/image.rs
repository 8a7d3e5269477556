//! The form in which a program is downloaded: a header and the program's bytes.
//!
//! Layout, little-endian: `SBI1`; CRC-32 of all that follows it; length of the body in bytes; product
//! code (0x1018,2) of the drive that it is for; version, 32 bytes of text filled up with zeros; 16
//! bytes reserved; the body.

use crate::flash::{CHUNK, Checksum};
use crate::program::Failure;

const MAGIC: [u8; 4] = *b"SBI1";

/// Bytes of the header.
pub const IMAGE_HEADER: usize = CHUNK;

/// Where that begins which the checksum covers.
const CHECKED_FROM: usize = 8;

/// A program's version: text of at most 32 bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Version([u8; 32]);

/// A text that cannot be a version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VersionError {
    /// It has more than 32 bytes.
    TooLong {
        /// Its bytes.
        bytes: usize,
    },
    /// It has a control character, or nothing.
    NotText,
}

impl core::fmt::Display for VersionError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            VersionError::TooLong { bytes } => write!(f, "{bytes} bytes, at most 32 are possible"),
            VersionError::NotText => f.write_str("empty, or it has a control character"),
        }
    }
}

impl core::error::Error for VersionError {}

impl Version {
    /// The version `text`.
    ///
    /// # Errors
    /// [`VersionError`].
    pub fn new(text: &str) -> Result<Version, VersionError> {
        if text.is_empty() || text.chars().any(char::is_control) {
            return Err(VersionError::NotText);
        }
        let mut bytes = [0; 32];
        let place = bytes.get_mut(..text.len());
        let place = place.ok_or(VersionError::TooLong { bytes: text.len() })?;
        place.copy_from_slice(text.as_bytes());
        Ok(Version(bytes))
    }

    /// The text; of bytes that are none, as much as is.
    #[must_use]
    pub fn text(&self) -> &str {
        let text = self.0.split(|byte| *byte == 0).next().unwrap_or(&[]);
        match core::str::from_utf8(text) {
            Ok(text) => text,
            Err(error) => text
                .get(..error.valid_up_to())
                .and_then(|text| core::str::from_utf8(text).ok())
                .unwrap_or(""),
        }
    }
}

impl core::fmt::Debug for Version {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.text().fmt(f)
    }
}

/// What a program's image says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageHeader {
    /// Bytes behind the header.
    pub body_bytes: u32,
    /// CRC-32 of the rest of the header and of the body; the program's software identification
    /// (0x1F56).
    pub checksum: u32,
    /// Product code (0x1018,2) of the drive that it is for.
    pub product: u32,
    /// Its version.
    pub version: Version,
}

impl ImageHeader {
    /// The header of the program `body`; at most 4 GiB less the header.
    #[must_use]
    pub fn of(product: u32, version: Version, body: &[u8]) -> ImageHeader {
        let mut header = ImageHeader {
            body_bytes: u32::try_from(body.len()).unwrap_or(u32::MAX),
            checksum: 0,
            product,
            version,
        };
        header.checksum = ImageHeader::checksum_start(&header.bytes())
            .and(body)
            .value();
        header
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; IMAGE_HEADER] {
        let mut bytes = [0; IMAGE_HEADER];
        let fields = MAGIC
            .into_iter()
            .chain(self.checksum.to_le_bytes())
            .chain(self.body_bytes.to_le_bytes())
            .chain(self.product.to_le_bytes())
            .chain(self.version.0);
        for (byte, value) in bytes.iter_mut().zip(fields) {
            *byte = value;
        }
        bytes
    }

    /// The header in `bytes`; `None` if they are none. The body is not looked at.
    #[must_use]
    pub fn parse(bytes: &[u8; IMAGE_HEADER]) -> Option<ImageHeader> {
        let mut words = bytes.as_chunks::<4>().0.iter().copied();
        let magic = words.next()?;
        let checksum = u32::from_le_bytes(words.next()?);
        let body_bytes = u32::from_le_bytes(words.next()?);
        let product = u32::from_le_bytes(words.next()?);
        let version = *bytes.get(16..)?.first_chunk::<32>()?;
        let header = ImageHeader {
            body_bytes,
            checksum,
            product,
            version: Version(version),
        };
        (magic == MAGIC && body_bytes > 0).then_some(header)
    }

    /// The checksum over what it covers of a header, to be continued over the body.
    #[must_use]
    pub(crate) fn checksum_start(bytes: &[u8; IMAGE_HEADER]) -> Checksum {
        Checksum::of(bytes.get(CHECKED_FROM..).unwrap_or(&[]))
    }

    /// Bytes of the whole image.
    #[must_use]
    pub const fn image_bytes(&self) -> u32 {
        self.body_bytes.saturating_add(IMAGE_HEADER as u32)
    }
}

/// Checks a whole image in memory.
///
/// # Errors
/// [`Failure::NotAnImage`], [`Failure::TooShort`], [`Failure::TooLong`], [`Failure::Checksum`]: what a
/// download of these bytes would end with.
pub fn check_image(image: &[u8]) -> Result<ImageHeader, Failure> {
    let received = u32::try_from(image.len()).unwrap_or(u32::MAX);
    let (raw, body) = image
        .split_first_chunk::<IMAGE_HEADER>()
        .ok_or(Failure::TooShort {
            expected: IMAGE_HEADER as u32,
            received,
        })?;
    let header = ImageHeader::parse(raw).ok_or(Failure::NotAnImage)?;
    let expected = header.image_bytes();
    if received < expected {
        return Err(Failure::TooShort { expected, received });
    }
    if received > expected {
        return Err(Failure::TooLong { expected });
    }
    let computed = ImageHeader::checksum_start(raw).and(body).value();
    if computed != header.checksum {
        let stated = header.checksum;
        return Err(Failure::Checksum { stated, computed });
    }
    Ok(header)
}
