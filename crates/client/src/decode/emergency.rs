//! Emergency error codes and the bits of the error register.

use canopen::Address;

use super::words::DriveWords;

/// Codes with a meaning of their own: CiA 301 table 26, CiA 402, and those of the P3's table
/// "Faults and Warnings", which keep to the same classes.
const CODES: &[(u16, &str)] = &[
    (0x0000, "error reset or no error"),
    (0x1000, "generic error"),
    (0x2310, "current limit active"),
    (0x2320, "short circuit"),
    (0x2330, "earth leakage"),
    (0x3110, "mains over-voltage"),
    (0x3120, "mains under-voltage"),
    (0x3210, "bus over-voltage"),
    (0x3220, "bus under-voltage"),
    (0x4210, "amplifier over-temperature"),
    (0x4310, "motor over-temperature"),
    (0x5112, "logic supply low"),
    (0x5210, "measurement circuit"),
    (0x5410, "output stage"),
    (0x5500, "data storage"),
    (0x5530, "non-volatile memory"),
    (0x6010, "watchdog reset"),
    (0x6320, "parameter error"),
    (0x7120, "motor"),
    (0x7121, "motor blocked"),
    (0x7122, "motor phasing error"),
    (0x7300, "sensor"),
    (0x7305, "encoder 1"),
    (0x7306, "encoder 2"),
    (0x7320, "encoder feedback error"),
    (0x7321, "encoder magnet distance"),
    (0x7380, "positive limit switch"),
    (0x7381, "negative limit switch"),
    (0x7382, "homing switch"),
    (0x7383, "positive soft stop"),
    (0x7384, "negative soft stop"),
    (0x73A0, "position wrapped"),
    (0x7510, "internal serial interface"),
    (0x8110, "CAN overrun, frames lost"),
    (0x8120, "CAN in error passive mode"),
    (0x8130, "guarding or heartbeat lost"),
    (0x8140, "recovered from bus-off"),
    (0x8150, "CAN-ID collision"),
    (0x8180, "SYNC lost"),
    (0x8210, "PDO not processed, too short"),
    (0x8220, "PDO too long"),
    (0x8240, "unexpected SYNC data length"),
    (0x8250, "RPDO timed out"),
    (0x8400, "velocity outside its limits"),
    (0x8411, "velocity tracking warning"),
    (0x8414, "velocity tracking fault"),
    (0x8418, "velocity limit active"),
    (0x8480, "acceleration limit active"),
    (0x8611, "position tracking warning"),
    (0x8612, "position outside its limits"),
    (0x8613, "homing error"),
    (0x8614, "position tracking fault"),
    (0x9000, "external error: safe torque off"),
];

/// Classes, by the bits that `mask` keeps; the narrower ones first.
const CLASSES: &[(u16, u16, &str)] = &[
    (0xFF00, 0x2100, "current, device input side"),
    (0xFF00, 0x2200, "current inside the device"),
    (0xFF00, 0x2300, "current, device output side"),
    (0xFF00, 0x3100, "mains voltage"),
    (0xFF00, 0x3200, "voltage inside the device"),
    (0xFF00, 0x3300, "output voltage"),
    (0xFF00, 0x4100, "ambient temperature"),
    (0xFF00, 0x4200, "device temperature"),
    (0xFF00, 0x4300, "drive temperature"),
    (0xFF00, 0x6100, "internal software"),
    (0xFF00, 0x6200, "user software"),
    (0xFF00, 0x6300, "data set"),
    (0xFF00, 0x7100, "power"),
    (0xFF00, 0x7300, "sensor"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol error"),
    (0xFF00, 0x8400, "velocity controller"),
    (0xFF00, 0x8600, "positioning controller"),
    (0xF000, 0x1000, "generic error"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0x9000, "external error"),
    (0xFF00, 0xF000, "additional functions"),
    (0xFF00, 0xFF00, "device specific"),
];

/// What an emergency error code means, or the class it belongs to (CiA 301 table 26).
pub fn emergency_text(code: u16) -> &'static str {
    let exact = CODES
        .iter()
        .find(|(known, _)| *known == code)
        .map(|(_, text)| *text);
    let class = || {
        CLASSES
            .iter()
            .find(|(mask, class, _)| code & mask == *class)
    };
    exact
        .or_else(|| class().map(|(_, _, text)| *text))
        .unwrap_or("unknown error code")
}

/// The set bits of an error register, 0x1001 (CiA 301 7.5.2.2), by the drive's names or the standard's;
/// "none" for 0.
pub(super) fn register_text(words: &DriveWords, register: u8) -> String {
    const BITS: [&str; 8] = [
        "generic",
        "current",
        "voltage",
        "temperature",
        "communication",
        "device profile",
        "reserved",
        "manufacturer",
    ];
    let set: Vec<&str> = (0..8_u8)
        .zip(BITS)
        .filter(|(bit, _)| register >> bit & 1 == 1)
        .map(|(bit, name)| words.bit(REGISTER, bit).unwrap_or(name))
        .collect();
    if set.is_empty() {
        "none".to_owned()
    } else {
        set.join(", ")
    }
}

const REGISTER: Address = Address::new(0x1001, 0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_of_a_drive_has_a_text_of_its_own() {
        for row in personalities::ALL.iter().flat_map(|drive| drive.faults) {
            assert!(
                CODES.iter().any(|(code, _)| *code == row.code),
                "0x{:04X} has only the text of its class",
                row.code
            );
        }
    }

    #[test]
    fn other_codes_fall_into_their_class() {
        assert_eq!(emergency_text(0x3299), "voltage inside the device");
        assert_eq!(emergency_text(0x5ABC), "device hardware");
        assert_eq!(emergency_text(0xFF01), "device specific");
        assert_eq!(emergency_text(0x0001), "unknown error code");
    }

    #[test]
    fn register_bits_are_named() {
        let text = |register| register_text(&DriveWords::default(), register);
        assert_eq!(text(0), "none");
        assert_eq!(text(0b101), "generic, voltage");
        assert_eq!(text(0x80), "manufacturer");
        let words = DriveWords {
            bits: &[(REGISTER, 7, "motion")],
            ..DriveWords::default()
        };
        assert_eq!(register_text(&words, 0x81), "generic, motion");
    }
}
