//! What a drive does of CiA 301, and how.

use canopen::{AcknowledgeData, RangeAbort, RpdoSync, SdoTransfers, UploadReply};
use personalities::Personality;

use super::{Drives, NONE, Part, address, has, row, run, yes};

pub(super) fn services(drives: Drives<'_>) -> Part {
    let sdo = |drive: &Personality| {
        match drive.device.dialect.sdo {
            SdoTransfers::Expedited => "expedited",
            SdoTransfers::All { .. } => "expedited, segments, blocks",
        }
        .to_owned()
    };
    let reply = |drive: &Personality| {
        match drive.device.dialect.upload_reply {
            UploadReply::Sized => "says its size",
            UploadReply::Unsized => "0x42, no size",
        }
        .to_owned()
    };
    let acknowledge = |drive: &Personality| {
        match drive.device.dialect.acknowledge_data {
            AcknowledgeData::Zeros => "zeros",
            AcknowledgeData::Echo => "the data",
        }
        .to_owned()
    };
    let range = |drive: &Personality| {
        match drive.device.dialect.range_abort {
            RangeAbort::TooHighTooLow => "0x06090031, 0x06090032",
            RangeAbort::Invalid => "0x06090030",
        }
        .to_owned()
    };
    let rpdo_sync = |drive: &Personality| {
        match drive.device.dialect.rpdo_sync {
            RpdoSync::Next => "the next SYNC",
            RpdoSync::Nth => "the nth SYNC",
        }
        .to_owned()
    };
    let flag = |name: &str, is: fn(&canopen::Dialect) -> bool| {
        row(name, drives, |drive| yes(is(&drive.device.dialect)))
    };
    let object =
        |name: &str, index: u16, sub: u8| row(name, drives, |drive| yes(has(drive, index, sub)));
    Part {
        title: "services",
        rows: vec![
            row("SDO transfers", drives, sdo),
            flag("SDO requests of 4 to 7 bytes", |dialect| {
                dialect.short_requests
            }),
            flag("SDO data longer by zeros", |dialect| {
                dialect.zero_padded_writes
            }),
            row("upload answer", drives, reply),
            row("download acknowledge holds", drives, acknowledge),
            row("abort out of range", drives, range),
            row("RPDOs", drives, |drive| run(drive, 0x1400, 512, 1)),
            row("TPDOs", drives, |drive| run(drive, 0x1800, 512, 1)),
            row("objects in a PDO", drives, |drive| {
                let highest = drive.device.table.highest_sub_index(0x1A00);
                highest.map_or(NONE.to_owned(), |highest| highest.to_string())
            }),
            row("RPDO type n is applied with", drives, rpdo_sync),
            flag("TPDO type 0 on every SYNC", |dialect| {
                dialect.tpdo_type_0_is_cyclic
            }),
            flag("TPDOs by events", |dialect| dialect.pdo_events),
            flag("TPDO type 254 by its timer", |dialect| {
                dialect.type_254_by_timer
            }),
            flag("parts of objects in PDOs", |dialect| dialect.short_mapping),
            flag("PDOs mapped while valid", |dialect| {
                dialect.reconfigure_while_valid
            }),
            flag("TPDOs in pre-operational", |dialect| {
                dialect.tpdo_in_pre_operational
            }),
            flag("remote requests", |dialect| dialect.remote_requests),
            flag("bit 30 of a TPDO stays set", |dialect| {
                dialect.tpdo_forbids_remote
            }),
            flag("identifiers of 29 bits", |dialect| {
                dialect.extended_identifiers
            }),
            flag("SYNC producer", |dialect| dialect.produces_sync),
            object("heartbeat producer", 0x1017, 0),
            object("heartbeat consumer", 0x1016, 1),
            object("guarding", 0x100C, 0),
            row("emergencies", drives, |drive| {
                yes(has(drive, 0x1014, 0) && drive.device.dialect.emergencies)
            }),
            flag("emergency inhibit time", |dialect| {
                dialect.emergencies && dialect.emcy_inhibit
            }),
            object("error history", 0x1003, 1),
            row("error history can be cleared", drives, |drive| {
                yes(has(drive, 0x1003, 1) && drive.device.dialect.history_clearable)
            }),
            object("time stamp", 0x1012, 0),
            flag("LSS", |dialect| dialect.lss),
            flag("boot-up frame", |dialect| dialect.boot_up),
            flag("operational after boot-up", |dialect| {
                dialect.boots_to_operational
            }),
            object("store 0x1010", 0x1010, 1),
            object("restore 0x1011", 0x1011, 1),
            object("program download", 0x1F50, 1),
            row("node ID by object", drives, |drive| match drive.node_id {
                Some(id) => address(id.address.index, id.address.sub),
                None => NONE.to_owned(),
            }),
            row("serial command line", drives, |drive| match drive.serial {
                Some(port) => format!("{} bit/s", port.bits_per_s),
                None => NONE.to_owned(),
            }),
        ],
    }
}
