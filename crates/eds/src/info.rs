//! Typed views of the sections that describe the file, the device and its place in a network.

use crate::model::{Eds, Section};
use crate::number::Number;

/// The bit rates of CiA 301 that a `[DeviceInfo]` can name, in kbit/s.
pub const BIT_RATES_KBIT: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

pub(crate) const FILE_INFO: &str = "FileInfo";
pub(crate) const DEVICE_INFO: &str = "DeviceInfo";
/// The standard's spelling.
pub(crate) const COMMISSIONING: &str = "DeviceComissioning";
pub(crate) const DUMMY_USAGE: &str = "DummyUsage";
pub(crate) const COMMENTS: &str = "Comments";

/// The sections that come first.
pub(crate) const INFO_SECTIONS: [&str; 5] =
    [FILE_INFO, DEVICE_INFO, COMMISSIONING, DUMMY_USAGE, COMMENTS];

/// `[FileInfo]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileInfo {
    /// `FileName`
    pub file_name: String,
    /// `FileVersion`
    pub version: Option<u32>,
    /// `FileRevision`
    pub revision: Option<u32>,
    /// `EDSVersion`, 3.0 where it is missing (CiA 306).
    pub eds_version: String,
    /// `Description`
    pub description: String,
    /// `LastEDS`: of a DCF, the EDS that it was made from.
    pub last_eds: Option<String>,
}

/// `[DeviceInfo]`; numbers are `None` where the file has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// `VendorName`
    pub vendor_name: String,
    /// `VendorNumber`: 0x1018,1.
    pub vendor_number: Option<u32>,
    /// `ProductName`
    pub product_name: String,
    /// `ProductNumber`: 0x1018,2.
    pub product_number: Option<u32>,
    /// `RevisionNumber`: 0x1018,3.
    pub revision_number: Option<u32>,
    /// `OrderCode`
    pub order_code: String,
    /// The bit rates that the device takes, in kbit/s.
    pub bit_rates_kbit: Vec<u16>,
    /// `SimpleBootUpMaster`
    pub simple_boot_up_master: bool,
    /// `SimpleBootUpSlave`
    pub simple_boot_up_slave: bool,
    /// `Granularity`: the smallest piece that a PDO maps, in bits; 0 if mapping is fixed.
    pub granularity: Option<u32>,
    /// `GroupMessaging`
    pub group_messaging: bool,
    /// `NrOfRXPDO`
    pub rpdos: Option<u32>,
    /// `NrOfTXPDO`
    pub tpdos: Option<u32>,
    /// `LSS_Supported`
    pub lss: bool,
}

/// `[DeviceComissioning]`: the place of a device in a network.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// `NodeID`, 1 to 127.
    pub node_id: u8,
    /// `NodeName`
    pub node_name: String,
    /// `Baudrate` in kbit/s; 0 if unknown.
    pub bit_rate_kbit: u16,
    /// `NetNumber`
    pub net_number: u32,
    /// `NetworkName`
    pub network_name: String,
    /// `CANopenManager`
    pub canopen_manager: bool,
    /// `LSS_SerialNumber`
    pub lss_serial_number: u32,
}

/// Which keys of these sections hold numbers.
pub(crate) fn is_numeric(section: &str, key: &str) -> bool {
    let key = key.to_ascii_lowercase();
    let key = key.as_str();
    match section {
        FILE_INFO => matches!(key, "fileversion" | "filerevision"),
        DEVICE_INFO => {
            key.starts_with("baudrate_")
                || matches!(
                    key,
                    "vendornumber"
                        | "productnumber"
                        | "revisionnumber"
                        | "simplebootupmaster"
                        | "simplebootupslave"
                        | "granularity"
                        | "dynamicchannelssupported"
                        | "groupmessaging"
                        | "nrofrxpdo"
                        | "nroftxpdo"
                        | "lss_supported"
                        | "compactpdo"
                )
        }
        COMMISSIONING => matches!(
            key,
            "nodeid" | "baudrate" | "netnumber" | "canopenmanager" | "lss_serialnumber"
        ),
        DUMMY_USAGE => key.starts_with("dummy"),
        COMMENTS => key == "lines",
        _ => false,
    }
}

fn text(section: &Section, key: &str) -> String {
    section.get(key).unwrap_or_default().to_owned()
}

pub(crate) fn number(section: &Section, key: &str) -> Option<u32> {
    let (number, _) = Number::read_commented(section.get(key)?)?;
    u32::try_from(number.base).ok()
}

fn flag(section: &Section, key: &str) -> bool {
    number(section, key).is_some_and(|number| number != 0)
}

impl Eds {
    /// `[FileInfo]`.
    pub fn file_info(&self) -> Option<FileInfo> {
        let section = self.section(FILE_INFO)?;
        Some(FileInfo {
            file_name: text(section, "FileName"),
            version: number(section, "FileVersion"),
            revision: number(section, "FileRevision"),
            eds_version: section.get("EDSVersion").unwrap_or("3.0").to_owned(),
            description: text(section, "Description"),
            last_eds: section.get("LastEDS").map(str::to_owned),
        })
    }

    /// `[DeviceInfo]`.
    pub fn device_info(&self) -> Option<DeviceInfo> {
        let section = self.section(DEVICE_INFO)?;
        let takes = |rate: &u16| flag(section, &format!("BaudRate_{rate}"));
        Some(DeviceInfo {
            vendor_name: text(section, "VendorName"),
            vendor_number: number(section, "VendorNumber"),
            product_name: text(section, "ProductName"),
            product_number: number(section, "ProductNumber"),
            revision_number: number(section, "RevisionNumber"),
            order_code: text(section, "OrderCode"),
            bit_rates_kbit: BIT_RATES_KBIT.into_iter().filter(takes).collect(),
            simple_boot_up_master: flag(section, "SimpleBootUpMaster"),
            simple_boot_up_slave: flag(section, "SimpleBootUpSlave"),
            granularity: number(section, "Granularity"),
            group_messaging: flag(section, "GroupMessaging"),
            rpdos: number(section, "NrOfRXPDO"),
            tpdos: number(section, "NrOfTXPDO"),
            lss: flag(section, "LSS_Supported"),
        })
    }

    /// `[DeviceComissioning]`, if it names a node ID from 1 to 127.
    pub fn commissioning(&self) -> Option<Commissioning> {
        let section = self.section(COMMISSIONING)?;
        let node_id = u8::try_from(number(section, "NodeID")?).ok()?;
        let bit_rate = number(section, "Baudrate").unwrap_or(0);
        (1..=127).contains(&node_id).then(|| Commissioning {
            node_id,
            node_name: text(section, "NodeName"),
            bit_rate_kbit: u16::try_from(bit_rate).unwrap_or(0),
            net_number: number(section, "NetNumber").unwrap_or(0),
            network_name: text(section, "NetworkName"),
            canopen_manager: flag(section, "CANopenManager"),
            lss_serial_number: number(section, "LSS_SerialNumber").unwrap_or(0),
        })
    }

    /// The data types that PDOs may map as dummies (`[DummyUsage]`), by their index.
    pub fn dummies(&self) -> Vec<u16> {
        let Some(section) = self.section(DUMMY_USAGE) else {
            return Vec::new();
        };
        let used = section.keys.iter().filter_map(|(key, _)| {
            let digits = key.get(5..).filter(|_| is_numeric(DUMMY_USAGE, key))?;
            let index = u16::from_str_radix(digits, 16).ok()?;
            flag(section, key).then_some(index)
        });
        used.collect()
    }
}
