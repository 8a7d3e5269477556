//! The objects that calibration and tuning use, as the P3's manual names them.

use canopen::{Address, DataType};

/// An object with what people are told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Where.
    pub address: Address,
    /// Its type.
    pub data_type: DataType,
    /// Its name, in lower case.
    pub name: &'static str,
    /// The unit of its values; empty for plain numbers.
    pub unit: &'static str,
}

impl Object {
    /// The entry of 0x1010,4 that saves it: index and sub-index (P4).
    pub(crate) fn entry(self) -> i64 {
        i64::from(self.address.index) << 8 | i64::from(self.address.sub)
    }
}

macro_rules! objects {
    ($($name:ident = $index:literal, $sub:literal, $type:ident, $text:literal, $unit:literal;)*) => {
        $(
            #[doc = concat!("Object ", stringify!($index), ",", stringify!($sub), ": ", $text, ".")]
            pub(crate) const $name: Object = Object {
                address: Address::new($index, $sub),
                data_type: DataType::$type,
                name: $text,
                unit: $unit,
            };
        )*
    };
}

objects! {
    DEVICE_TYPE = 0x1000, 0, U32, "device type", "";
    SAVE_ENTRY = 0x1010, 4, U32, "save single entry", "";
    MAX_SUPPLY = 0x2384, 6, U16, "amplifier max voltage", "0.1 V";
    MIN_SUPPLY = 0x2384, 7, U16, "amplifier min voltage", "0.1 V";
    MAX_TEMPERATURE = 0x2384, 9, U8, "amplifier max temperature", "degC";
    SYNC_LOSS = 0x2406, 0, U16, "SYNC loss fault time-out", "ms";
    SUPPLY = 0x3000, 1, U16, "sensed bus voltage", "0.1 V";
    TEMPERATURE = 0x3000, 2, I16, "amplifier temperature", "degC";
    PWM_FREQUENCY = 0x3001, 1, U32, "PWM frequency", "Hz";
    AMPLIFIER_CURRENT = 0x3001, 8, I16, "maximum current", "mA";
    CURRENT_SENSE_A = 0x3008, 1, U16, "filtered current sense, phase A", "count/16";
    CURRENT_SENSE_B = 0x3008, 2, U16, "filtered current sense, phase B", "count/16";
    CURRENT_BIAS_A = 0x3009, 1, U16, "current sensor bias, phase A", "count";
    CURRENT_BIAS_B = 0x3009, 2, U16, "current sensor bias, phase B", "count";
    VOLTAGE_D = 0x3010, 4, I16, "phase voltage", "1/32768";
    VOLTAGE_Q = 0x3010, 5, I16, "voltage of the q axis", "1/32768";
    CURRENT_D = 0x3010, 6, I16, "current of the d axis", "mA";
    ELECTRICAL_ZERO = 0x3011, 1, I16, "electrical zero", "count";
    ELECTRICAL_POLARITY = 0x3011, 2, I8, "electrical polarity", "";
    POLES = 0x3011, 3, I8, "pole count", "";
    TORQUE_CONSTANT = 0x3011, 4, U16, "torque constant", "mNm/A";
    RESISTANCE = 0x3011, 5, U16, "terminal resistance", "0.01 ohm";
    INDUCTANCE = 0x3011, 6, U16, "terminal inductance", "0.01 mH";
    ROTOR_INERTIA = 0x3011, 7, U32, "rotor inertia", "gcm2/32768";
    CONTINUOUS_CURRENT = 0x3011, 8, I16, "max continuous current", "mA";
    PEAK_CURRENT = 0x3011, 9, I16, "peak current", "mA";
    CALIBRATION_CURRENT = 0x3011, 11, I16, "calibration current", "mA";
    RAW_ENCODER = 0x3012, 1, I16, "raw encoder reading", "count";
    ENCODER_RESOLUTION = 0x3013, 1, U32, "encoder resolution", "count/turn";
    ENCODER_LAG = 0x3013, 5, U32, "encoder lag", "us";
    POSITION_BANDWIDTH = 0x3019, 5, U16, "position control bandwidth", "0.1 Hz";
    POSITION_DAMPING = 0x3019, 6, U16, "position damping", "1/256";
    POSITION_INTEGRAL = 0x3019, 8, I32, "position integral gain", "1/32768";
    VELOCITY_BANDWIDTH = 0x3019, 10, U16, "velocity control bandwidth", "0.1 Hz";
    VELOCITY_DAMPING = 0x3019, 11, U16, "velocity damping", "1/256";
    ERROR_CODE = 0x603F, 0, U16, "last error", "";
    CONTROLWORD = 0x6040, 0, U16, "control word", "";
    STATUSWORD = 0x6041, 0, U16, "status word", "";
    MODE = 0x6060, 0, I8, "mode of operation", "";
    MODE_DISPLAY = 0x6061, 0, I8, "mode of operation display", "";
    POSITION = 0x6064, 0, I32, "actual position", "count";
    TARGET_TORQUE = 0x6071, 0, I16, "target torque", "permille";
    RATED_TORQUE = 0x6076, 0, I32, "rated torque", "mNm";
    ACTUAL_TORQUE = 0x6077, 0, I16, "actual torque", "permille";
    USER_POLARITY = 0x607E, 0, I8, "user polarity", "";
    MAX_MOTOR_VELOCITY = 0x6080, 0, I32, "no-load speed", "count/s";
    VELOCITY_OFFSET = 0x60B1, 0, I32, "velocity offset", "count/s";
    TORQUE_OFFSET = 0x60B2, 0, I16, "torque offset", "permille";
    ELECTRICAL_ANGLE = 0x60EA, 0, I16, "electrical angle", "1/65536 turn";
    TARGET_POSITION = 0x607A, 0, I32, "target position", "count";
    TARGET_VELOCITY = 0x60FF, 0, I32, "target velocity", "count/s";
}
