//! Why a program is not there, as 0x1F57 tells it and as the SDO transfer is aborted.

use canopen::Abort;

use crate::flash::FlashError;

/// Why the last download or command did not succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// There is no valid program to be started.
    NoProgram,
    /// The bytes do not begin as an image does, or it has no body.
    NotAnImage,
    /// It is for another drive.
    OtherProduct {
        /// This drive's product code.
        wanted: u32,
        /// The image's.
        found: u32,
    },
    /// It ended too early, or fewer bytes were announced than the image says.
    TooShort {
        /// Bytes of the image.
        expected: u32,
        /// Bytes that came or were announced.
        received: u32,
    },
    /// More bytes came or were announced than the image says.
    TooLong {
        /// Bytes of the image.
        expected: u32,
    },
    /// The checksum differs.
    Checksum {
        /// The image's.
        stated: u32,
        /// That of what came.
        computed: u32,
    },
    /// The client has aborted the transfer, or it has timed out.
    Aborted {
        /// Bytes that had come.
        received: u32,
    },
    /// The bank was not cleared before (0x1F51 := 3).
    NotCleared,
    /// The flash has refused to erase, to write or to be read.
    Flash(FlashError),
    /// The bank does not read back as it was written.
    NotKept,
    /// The image does not fit into a bank.
    OutOfBank {
        /// Its bytes.
        bytes: u32,
        /// The most that fit.
        capacity: u32,
    },
    /// Bytes came for another place than the next.
    OutOfOrder {
        /// The next place.
        expected: u32,
        /// Theirs.
        at: u32,
    },
}

impl Failure {
    /// Error code of 0x1F57, bits 1 to 7 (CiA 302-3), this drive's number for the reason, bits 16 to
    /// 31, and how the transfer is aborted.
    const fn table(self) -> (u8, u16, Abort) {
        match self {
            Failure::NoProgram => (1, 1, Abort::DEVICE_STATE),
            Failure::NotAnImage => (2, 2, Abort::CANNOT_STORE),
            Failure::OtherProduct { .. } => (2, 3, Abort::CANNOT_STORE),
            Failure::TooShort { .. } => (3, 4, Abort::TOO_SHORT),
            Failure::TooLong { .. } => (3, 5, Abort::TOO_LONG),
            Failure::Checksum { .. } => (3, 6, Abort::CANNOT_STORE),
            Failure::Aborted { .. } => (3, 7, Abort::GENERAL),
            Failure::NotCleared => (4, 8, Abort::DEVICE_STATE),
            Failure::Flash(_) => (5, 9, Abort::HARDWARE),
            Failure::NotKept => (5, 10, Abort::HARDWARE),
            Failure::OutOfBank { .. } => (6, 11, Abort::TOO_LONG),
            Failure::OutOfOrder { .. } => (6, 12, Abort::GENERAL),
        }
    }

    /// What 0x1F57 reads as after it.
    #[must_use]
    pub const fn status(self) -> u32 {
        let (code, reason, _) = self.table();
        (reason as u32) << 16 | (code as u32) << 1
    }

    /// How the transfer, or the write to 0x1F51, is aborted.
    #[must_use]
    pub const fn abort(self) -> Abort {
        self.table().2
    }
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Failure::NoProgram => f.write_str("there is no valid program"),
            Failure::NotAnImage => {
                f.write_str("not a program image (it does not begin SBI1, or has no body)")
            }
            Failure::OtherProduct { wanted, found } => {
                write!(f, "for product 0x{found:X}, and the drive is 0x{wanted:X}")
            }
            Failure::TooShort { expected, received } => {
                write!(f, "too short: {received} bytes, the image has {expected}")
            }
            Failure::TooLong { expected } => {
                write!(f, "too long: the image has {expected} bytes, and more came")
            }
            Failure::Checksum { stated, computed } => {
                write!(
                    f,
                    "checksum 0x{stated:08X} stated, 0x{computed:08X} computed"
                )
            }
            Failure::Aborted { received } => write!(f, "aborted after {received} bytes"),
            Failure::NotCleared => f.write_str("the program memory was not cleared before"),
            Failure::Flash(error) => error.fmt(f),
            Failure::NotKept => f.write_str("the flash does not read back as written"),
            Failure::OutOfBank { bytes, capacity } => {
                write!(
                    f,
                    "{bytes} bytes, and {capacity} fit into the program memory"
                )
            }
            Failure::OutOfOrder { expected, at } => {
                write!(f, "bytes for place {at} where {expected} is next")
            }
        }
    }
}

impl core::error::Error for Failure {}

impl From<FlashError> for Failure {
    fn from(error: FlashError) -> Failure {
        Failure::Flash(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_storage::nor_flash::NorFlashErrorKind;

    /// The error codes of CiA 302-3 in bits 1 to 7, and reasons that are told apart.
    #[test]
    fn flash_status() {
        let flash = FlashError {
            kind: NorFlashErrorKind::Other,
            at: 0,
        };
        let found = [
            (Failure::NoProgram, 0x0001_0002),
            (Failure::NotAnImage, 0x0002_0004),
            (
                Failure::OtherProduct {
                    wanted: 1,
                    found: 2,
                },
                0x0003_0004,
            ),
            (
                Failure::TooShort {
                    expected: 2,
                    received: 1,
                },
                0x0004_0006,
            ),
            (Failure::TooLong { expected: 1 }, 0x0005_0006),
            (
                Failure::Checksum {
                    stated: 1,
                    computed: 2,
                },
                0x0006_0006,
            ),
            (Failure::Aborted { received: 0 }, 0x0007_0006),
            (Failure::NotCleared, 0x0008_0008),
            (Failure::Flash(flash), 0x0009_000A),
            (Failure::NotKept, 0x000A_000A),
            (
                Failure::OutOfBank {
                    bytes: 2,
                    capacity: 1,
                },
                0x000B_000C,
            ),
            (Failure::OutOfOrder { expected: 1, at: 0 }, 0x000C_000C),
        ];
        for (failure, status) in found {
            assert_eq!(failure.status(), status, "{failure}");
            assert_ne!(failure.abort().text(), None);
        }
    }
}
