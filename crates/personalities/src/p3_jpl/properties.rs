//! BarrettCAN properties, 0x3F00: a sub-index is a property's number.
//!
//! The manual names two numbers, 20 THERM and 50 DP; the others are those of Barrett's own library for
//! firmware 145 and later, which agree with the two. A property of 32 bits takes two numbers, the
//! second of which reads 0. Those whose meaning no text tells are 0; the units of the others are this
//! project's.

use canopen::row::u32;
use canopen::{Dictionary, Row};

use crate::p3::scaled;
use crate::{Figure, Scaled};

/// Index of the properties.
pub const INDEX: u16 = 0x3F00;

/// Numbers up to this one are properties.
pub const LAST: u8 = 108;

/// OTEMP: amplifier and motor are switched off above it, °C in Q8.8.
pub const OVER_TEMPERATURE: u8 = 11;
/// MT: greatest torque, per mille of rated torque.
pub const MAX_TORQUE: u8 = 43;
/// MV: greatest velocity, counts/ms.
pub const MAX_VELOCITY: u8 = 45;
/// MOFST: encoder reading with the rotor under phase A, counts.
pub const ELECTRICAL_ZERO: u8 = 61;
/// MECH: the encoder's reading, counts.
pub const MECHANICAL: u8 = 66;
/// CTS: counts of a turn.
pub const TURN: u8 = 68;
/// POLES: poles of the motor.
pub const POLES: u8 = 90;

/// It has its default for ever.
const fn value(number: u8, name: &'static str) -> Row {
    u32(INDEX, number, name).tpdo()
}

/// The drive shows it.
const fn shown(number: u8, name: &'static str) -> Row {
    value(number, name).live()
}

/// "BarrettCAN Property Access", U32, RO (J18).
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    value(0, "VERS").default(145),
    shown(1, "ROLE"),
    shown(2, "SN"),
    shown(3, "ID"),
    shown(4, "ERROR"),
    value(5, "STAT").default(2),
    value(6, "ADDR"),
    value(7, "VALUE"),
    shown(8, "MODE"),
    shown(9, "TEMP").unit("degC/256"),
    shown(10, "PTEMP").unit("degC/256"),
    value(11, "OTEMP").unit("degC/256").default(85 << 8),
    value(12, "BAUD"),
    value(13, "LOCK"),
    value(14, "DIG0"),
    value(15, "DIG1"),
    value(16, "FET0"),
    value(17, "FET1"),
    value(18, "ANA0"),
    value(19, "ANA1"),
    shown(20, "THERM").unit("degC/256"),
    shown(21, "VBUS").unit("V/256"),
    shown(22, "IMOTOR").unit("mA"),
    value(23, "VLOGIC"),
    value(24, "ILOGIC"),
    value(25, "SG"),
    value(26, "GRPA"),
    value(27, "GRPB").default(1),
    value(28, "GRPC").default(4),
    value(29, "CMD"),
    value(30, "SAVE"),
    value(31, "LOAD"),
    value(32, "DEF"),
    value(33, "FIND"),
    value(34, "X0"),
    value(35, "X1"),
    value(36, "X2"),
    value(37, "X3"),
    value(38, "X4"),
    value(39, "X5"),
    value(40, "X6"),
    value(41, "X7"),
    shown(42, "T").unit("permille"),
    value(43, "MT").unit("permille").default(2000),
    shown(44, "V").unit("cts/ms"),
    value(45, "MV").unit("cts/ms").default(900),
    value(46, "MCV").unit("cts/ms").default(900),
    value(47, "MOV").unit("cts/ms").default(900),
    shown(48, "P").unit("cts"),
    value(49, "P2"),
    value(50, "DP").unit("cts").default(0x8000),
    value(51, "DP2"),
    shown(52, "E").unit("cts"),
    value(53, "E2"),
    value(54, "OT"),
    value(55, "OT2"),
    value(56, "CT"),
    value(57, "CT2"),
    value(58, "M"),
    value(59, "M2"),
    value(60, "DS"),
    value(61, "MOFST").unit("cts").default(0x0DF8),
    value(62, "IOFST").unit("count").default(0x0729),
    shown(63, "UPSECS").unit("s"),
    value(64, "OD"),
    value(65, "MDS"),
    shown(66, "MECH").unit("cts"),
    value(67, "MECH2"),
    value(68, "CTS").unit("cts/rev").default(4096),
    value(69, "CTS2"),
    value(70, "PIDX"),
    value(71, "HSG"),
    value(72, "LSG"),
    value(73, "IVEL"),
    value(74, "IOFF").unit("count").default(2071),
    value(75, "IOFF2"),
    value(76, "MPE"),
    value(77, "HOLD").default(1),
    value(78, "TSTOP"),
    value(79, "KP"),
    value(80, "KD"),
    value(81, "KI"),
    shown(82, "ACCEL").unit("cts/ms2"),
    value(83, "TENST"),
    value(84, "TENSO"),
    value(85, "JIDX"),
    value(86, "IPNM").unit("permille/Nm").default(43478),
    value(87, "HALLS"),
    value(88, "HALLH"),
    value(89, "HALLH2"),
    value(90, "POLES").default(2),
    value(91, "IKP"),
    value(92, "IKI"),
    value(93, "IKCOR"),
    shown(94, "EN").unit("cts"),
    value(95, "EN2"),
    shown(96, "JP").unit("cts"),
    value(97, "JP2"),
    value(98, "JOFST"),
    value(99, "JOFST2"),
    value(100, "TIE"),
    value(101, "ECMAX"),
    value(102, "ECMIN"),
    value(103, "LFLAGS"),
    value(104, "LCTC"),
    value(105, "LCVC"),
    value(106, "TACT"),
    value(107, "TACTID"),
    value(108, "IHIT"),
    value(109, "No property").subs(19),
];

/// Where a property that the drive core reads lies.
pub(super) const fn object<const N: usize>(
    objects: &Dictionary<N>,
    number: u8,
    scale: f32,
) -> Scaled {
    scaled(objects, INDEX, number, scale)
}

/// The same where there need not be an object.
pub(super) const fn property<const N: usize>(
    objects: &Dictionary<N>,
    number: u8,
    scale: f32,
) -> Figure {
    Figure::Object(object(objects, number, scale))
}

/// Whether a property takes two numbers: BarrettCAN answers it with four bytes, others with two.
pub fn is_long(number: u8) -> bool {
    const LONG: &[u8] = &[48, 50, 52, 54, 56, 58, 66, 68, 74, 88, 94, 96, 98];
    LONG.contains(&number)
}
