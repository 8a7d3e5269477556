//! The restricted identifiers (CiA 301 7.3.5).

/// The identifiers that CiA 301 table 40 keeps for its own services.
pub(crate) fn is_restricted(id: u32) -> bool {
    matches!(
        id,
        0x000..=0x07F
            | 0x101..=0x180
            | 0x581..=0x5FF
            | 0x601..=0x67F
            | 0x6E0..=0x6FF
            | 0x701..=0x7FF
    )
}
