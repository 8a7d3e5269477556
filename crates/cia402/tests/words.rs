//! Controlword and statusword in words.

use cia402::{Controlword, Mode, Statusword};

#[test]
fn statuswords() {
    let table = [
        (
            0x0637,
            0,
            "operation enabled, voltage, remote, target reached",
        ),
        (0x0250, 0, "switch on disabled, voltage, remote"),
        (0x0218, 0, "fault, voltage, remote"),
        (0x021F, 0, "fault reaction active, voltage, remote"),
        (0x0217, 0, "quick stop active, voltage, remote"),
        (0x0000, 0, "not ready to switch on"),
        (0x0005, 0, "no state (0x05)"),
        (0x00A1, 0, "ready to switch on, warning"),
        (
            0x1C37,
            1,
            "operation enabled, voltage, target reached, internal limit, set-point acknowledge",
        ),
        (0x2027, 1, "operation enabled, following error"),
        (0x2027, 8, "operation enabled, following error"),
        (0x1027, 8, "operation enabled, follows command"),
        (0x1027, 3, "operation enabled, speed is zero"),
        (0x3027, 4, "operation enabled, bit 12, bit 13"),
        (0xC123, 0, "switched on, bit 8, bit 14, bit 15"),
    ];
    for (word, mode, text) in table {
        assert_eq!(
            Statusword(word).in_mode(Mode(mode)).to_string(),
            text,
            "{word:04X}"
        );
    }
    assert_eq!(
        Statusword(0x3027).to_string(),
        "operation enabled, bit 12, bit 13"
    );
}

#[test]
fn controlwords() {
    let table = [
        (0x0000, 0, "disable voltage"),
        (0x0002, 0, "quick stop"),
        (0x0006, 0, "shutdown"),
        (0x000E, 0, "shutdown"),
        (0x0007, 0, "switch on"),
        (0x000F, 0, "enable operation"),
        (0x0086, 0, "shutdown, fault reset"),
        (
            0x003F,
            1,
            "enable operation, new set-point, change immediately",
        ),
        (
            0x025F,
            1,
            "enable operation, new set-point, relative, change on set-point",
        ),
        (0x001F, 6, "enable operation, start homing"),
        (0x010F, 3, "enable operation, halt"),
        (
            0x007F,
            2,
            "enable operation, enable ramp, unlock ramp, reference ramp",
        ),
        (0x801F, 0, "enable operation, bit 4, bit 15"),
    ];
    for (word, mode, text) in table {
        assert_eq!(
            Controlword(word).in_mode(Mode(mode)).to_string(),
            text,
            "{word:04X}"
        );
    }
    assert_eq!(Controlword(0x001F).to_string(), "enable operation, bit 4");
    assert_eq!(Mode(1).to_string(), "profile position");
    assert_eq!(Mode(-4).to_string(), "mode -4");
}
