//! How a client transfers.

/// How expedited requests are written. All others are as the standard says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RequestForm {
    /// Eight bytes, size indicated (CiA 301 7.2.4.3.3): every server takes these.
    #[default]
    Sized,
    /// Eight bytes, size not indicated (0x22).
    Unsized,
    /// As long as their contents, size not indicated: as the P3's manual prints them (P1).
    Short,
}

/// Which protocol a transfer uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// In one exchange, up to 4 bytes. An upload that the server begins to segment is aborted.
    Expedited,
    /// One confirmation per segment of 7 bytes. An upload becomes expedited if the server says so.
    Segmented,
    /// One confirmation per block of segments. An upload becomes segmented or expedited if the
    /// server says so and [`Settings::switch_threshold`] allows it.
    Block,
}

/// Times, numbers of attempts and the details of block transfers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// How long to wait for an answer, in nanoseconds.
    pub answer_ns: u64,
    /// How long a block upload that has begun may pause, in nanoseconds. Then what is missing is
    /// taken for lost and asked for again.
    pub pause_ns: u64,
    /// How often a request is sent, and a transfer begun, in all; 0 counts as 1. A repeated write
    /// may be obeyed twice, so 1 unless the object allows more.
    pub attempts: u32,
    /// How expedited requests are written.
    pub form: RequestForm,
    /// Segments per block that block uploads ask for, 1 to 127; others count as the nearest.
    pub block_size: u8,
    /// Whether block transfers offer a checksum; it is used if the server offers it, too.
    pub crc: bool,
    /// The protocol switch threshold of block uploads (CiA 301 7.2.4.3.12): the server may send
    /// objects of up to this many bytes by another protocol; 0 forbids it.
    pub switch_threshold: u8,
}

impl Settings {
    /// 500 ms, 100 ms, one attempt, standard form, blocks of 127 segments with checksum, a
    /// threshold of 21 bytes: three segments, from which on a block is not slower.
    pub const DEFAULT: Settings = Settings {
        answer_ns: 500_000_000,
        pause_ns: 100_000_000,
        attempts: 1,
        form: RequestForm::Sized,
        block_size: 127,
        crc: true,
        switch_threshold: 21,
    };
}

impl Default for Settings {
    fn default() -> Settings {
        Settings::DEFAULT
    }
}
