//! personalities
