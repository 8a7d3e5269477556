//! Generates the two zencan-node object dictionaries, of 50 and of 500 objects.
//!
//! zencan-node wants its dictionary at build time, generated from a TOML file. The files differ in
//! length alone, so they are written here instead of being kept.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// What zencan-build adds of its own: 1000h, 1001h, 1008h, 1009h, 100Ah, 1010h, 1017h, 1018h,
/// 5000h, and two objects for each of four RPDOs and four TPDOs.
const STANDARD_OBJECTS: u16 = 9 + 16;

/// Where the objects of the application begin.
const FIRST_OBJECT: u16 = 0x2000;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    for (name, objects) in [("OBJECTS_50", 50), ("OBJECTS_500", 500)] {
        if let Err(message) = generate(&out, name, objects) {
            eprintln!("zencan-node dictionary {name}: {message}");
            process::exit(1);
        }
    }
}

fn generate(out: &Path, name: &str, objects: u16) -> Result<(), String> {
    let path = out.join(format!("{name}.toml"));
    fs::write(&path, device_config(objects)).map_err(|e| e.to_string())?;
    zencan_build::build_node_from_device_config(name, &path).map_err(|e| e.to_string())
}

/// A device of `objects` objects, four TPDOs of 2 × 32 bit on each SYNC, and a heartbeat.
fn device_config(objects: u16) -> String {
    let mut text = String::from(
        r#"
device_name = "bench"
hardware_version = "1"
software_version = "1"
heartbeat_period = 1000

[identity]
vendor_id = 1
product_code = 2
revision_number = 3

[pdos]
num_rpdo = 4
num_tpdo = 4
"#,
    );
    for pdo in 0..4 {
        let cob_id = 0x180 + 0x100 * pdo;
        let (first, second) = (FIRST_OBJECT + 2 * pdo, FIRST_OBJECT + 2 * pdo + 1);
        write!(
            text,
            r#"
[pdos.tpdo.{pdo}]
enabled = true
cob_id = {cob_id}
add_node_id = true
transmission_type = 1
mappings = [{{ index = {first}, sub = 0, size = 32 }}, {{ index = {second}, sub = 0, size = 32 }}]
"#
        )
        .expect("writing to a String");
    }
    for index in FIRST_OBJECT..FIRST_OBJECT + objects - STANDARD_OBJECTS {
        // The index in both halves, as `bench::subject::value_of` expects it.
        let value = u32::from(index) << 16 | u32::from(index);
        write!(
            text,
            r#"
[[objects]]
index = {index}
parameter_name = "Object {index:X}h"
object_type = "var"
data_type = "uint32"
access_type = "rw"
pdo_mapping = "both"
default_value = {value}
"#
        )
        .expect("writing to a String");
    }
    text
}
