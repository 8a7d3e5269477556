//! canopen
