//! What a row of a dictionary table is in an EDS: the only place that knows both.

use canopen::{Default, Row};

use crate::types::{Access, DataType};
use crate::value::Value;

/// The data type's code.
pub(crate) fn data_type(row: &Row) -> DataType {
    match row.data_type {
        canopen::DataType::Bool => DataType::BOOLEAN,
        canopen::DataType::I8 => DataType::INTEGER8,
        canopen::DataType::I16 => DataType::INTEGER16,
        canopen::DataType::I32 => DataType::INTEGER32,
        canopen::DataType::U8 => DataType::UNSIGNED8,
        canopen::DataType::U16 => DataType::UNSIGNED16,
        canopen::DataType::U32 => DataType::UNSIGNED32,
        canopen::DataType::F32 => DataType::REAL32,
        canopen::DataType::I64 => DataType::INTEGER64,
        canopen::DataType::U64 => DataType::UNSIGNED64,
        canopen::DataType::F64 => DataType::REAL64,
        canopen::DataType::Text => DataType::VISIBLE_STRING,
        canopen::DataType::Bytes => DataType::OCTET_STRING,
        canopen::DataType::Domain => DataType::DOMAIN,
    }
}

/// The value after a reset; a stream has none. COB-IDs, mappings and identities are read in
/// hexadecimal.
pub(crate) fn default(row: &Row) -> Option<Value> {
    let data_type = data_type(row);
    // A default that lies outside its range is no value that anyone could write.
    if row.is_unset {
        return None;
    }
    if matches!(
        row.data_type,
        canopen::DataType::Domain | canopen::DataType::Bytes
    ) {
        return None;
    }
    let is_wide = row.address.is_communication() && data_type == DataType::UNSIGNED32;
    let text = match row.default {
        Default::Value(value) if is_wide => format!("0x{value:08X}"),
        Default::Value(value) => value.to_string(),
        Default::Real(value) => value.to_string(),
        Default::PlusNode(base) => format!("$NODEID+0x{base:X}"),
        Default::Text(text) => text.to_owned(),
    };
    Some(Value::new(&text, Some(data_type)))
}

/// Who may read and write it by SDO; of what can be read and written, whether PDOs go one way only.
pub(crate) fn access(row: &Row) -> Access {
    match (row.access, row.maps_rpdo, row.maps_tpdo) {
        (canopen::Access::Constant, ..) => Access::Constant,
        // Not listed ([`canopen::Access::Internal`]).
        (canopen::Access::Internal, ..) => Access::ReadOnly,
        (canopen::Access::ReadOnly, ..) => Access::ReadOnly,
        (canopen::Access::WriteOnly, ..) => Access::WriteOnly,
        (canopen::Access::ReadWrite, true, false) => Access::ReadWriteOutput,
        (canopen::Access::ReadWrite, false, true) => Access::ReadWriteInput,
        (canopen::Access::ReadWrite, ..) => Access::ReadWrite,
    }
}
