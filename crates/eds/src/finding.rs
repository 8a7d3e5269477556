//! What is wrong with a file, where, and what to do.

use std::fmt;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Not as CiA 306 says, but there is only one way to read it.
    Tolerated,
    /// Used as read, but it contradicts something else, or other programs will stumble over it.
    Warning,
    /// Could not be used; something of the file is lost.
    Error,
}

impl Severity {
    /// The word in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Severity::Tolerated => "tolerated",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A place in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// Counted from 1; 0 if the finding concerns the file as a whole.
    pub line: u32,
    /// Counted from 1, in characters; 0 as for the line.
    pub column: u32,
}

macro_rules! rules {
    ($($(#[$doc:meta])* $rule:ident $severity:ident $name:literal,)*) => {
        /// What kind of defect a finding is; it tells the severity.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Rule { $($(#[$doc])* $rule,)* }

        impl Rule {
            /// Every rule.
            pub const ALL: &[Rule] = &[$(Rule::$rule,)*];

            /// How bad it is.
            pub const fn severity(self) -> Severity {
                match self { $(Rule::$rule => Severity::$severity,)* }
            }

            /// The short name behind a message.
            pub const fn name(self) -> &'static str {
                match self { $(Rule::$rule => $name,)* }
            }
        }
    };
}

rules! {
    /// The file is larger than [`crate::MAX_BYTES`], or has too many sections.
    TooLarge Error "too-large",
    /// UTF-16, which no EDS reader takes.
    Utf16 Error "utf-16",
    /// A UTF-8 byte order mark.
    ByteOrderMark Tolerated "byte-order-mark",
    /// Characters beyond ASCII in UTF-8.
    Utf8 Tolerated "utf-8",
    /// Bytes that are no UTF-8, read as ISO 8859-1.
    Latin1 Tolerated "latin-1",
    /// A line of more than 255 characters.
    LongLine Tolerated "long-line",
    /// A section's name without its closing bracket.
    UnclosedSection Tolerated "unclosed-section",
    /// Something behind a section's closing bracket.
    AfterSection Tolerated "after-section",
    /// A comment that begins with `#`.
    HashComment Tolerated "hash-comment",
    /// A comment behind a number.
    InlineComment Tolerated "inline-comment",
    /// A line that is no section, no key and no comment.
    NoKey Error "no-key",
    /// A key before the first section.
    OutsideSection Error "outside-section",
    /// A section without a name.
    EmptySection Error "empty-section",
    /// A section that is there already.
    DuplicateSection Error "duplicate-section",
    /// A key that is there already, with another value.
    DuplicateKey Error "duplicate-key",
    /// A key that is there already, with the same value.
    RepeatedKey Tolerated "repeated-key",
    /// `[DeviceCommissioning]`, which the standard spells with one m.
    SectionSpelling Tolerated "section-spelling",
    /// A section that every file has.
    MissingSection Warning "missing-section",
    /// A keyword that wants a number has none.
    NotANumber Error "not-a-number",
    /// A leading 0 makes a number octal.
    OctalNumber Warning "octal-number",
    /// A leading 0, but no octal number.
    LeadingZero Warning "leading-zero",
    /// `$NODEID` in another form than `$NODEID+0x180`.
    NodeIdForm Tolerated "node-id-form",
    /// A real number as a bit pattern.
    RealBits Tolerated "real-bits",
    /// `true` or `false` for 1 or 0.
    BooleanWord Tolerated "boolean-word",
    /// A value that its data type cannot hold.
    OutOfRange Warning "out-of-range",
    /// A value that is none of its data type.
    BadValue Warning "bad-value",
    /// A default or value beyond the limits.
    OutsideLimits Warning "outside-limits",
    /// The low limit is above the high limit.
    CrossedLimits Warning "crossed-limits",
    /// An access type that the standard does not know.
    UnknownAccess Error "unknown-access",
    /// An access type written in another way.
    AccessForm Tolerated "access-form",
    /// An object type that the standard does not know.
    UnknownObjectType Error "unknown-object-type",
    /// A data type that neither the standard nor the file defines.
    UnknownDataType Warning "unknown-data-type",
    /// `PDOMapping=` without a value.
    EmptyPdoMapping Tolerated "empty-pdo-mapping",
    /// Neither 0 nor 1 where one of them is wanted.
    BadFlag Tolerated "bad-flag",
    /// An object without a name.
    MissingName Warning "missing-name",
    /// An object without a data type.
    MissingDataType Warning "missing-data-type",
    /// An object without an access type.
    MissingAccess Warning "missing-access",
    /// A sub-object whose object is not described.
    MissingParent Warning "missing-parent",
    /// A variable with sub-objects.
    SubsOfVariable Warning "subs-of-variable",
    /// An array or record without sub-objects.
    NoSubs Warning "no-subs",
    /// An array or record without sub-index 0.
    MissingSub0 Warning "missing-sub-0",
    /// `SubNumber` differs from the number of sub-objects.
    WrongSubNumber Warning "wrong-sub-number",
    /// Sub-index 0 differs from the highest sub-index.
    WrongHighest Warning "wrong-highest",
    /// A PDO mapping counts entries that map nothing.
    MappingCount Warning "mapping-count",
    /// A sub-index above 255.
    BadSubIndex Error "bad-sub-index",
    /// Two sub-objects of one object have the same name.
    DuplicateName Warning "duplicate-name",
    /// Two objects have the same name.
    RepeatedName Tolerated "repeated-name",
    /// A name that some readers cut off.
    NameForm Warning "name-form",
    /// An object that no list names.
    NotListed Warning "not-listed",
    /// An object that the lists name twice.
    ListedTwice Warning "listed-twice",
    /// A list names an object that is not described.
    ListedMissing Error "listed-missing",
    /// An object in the list of another index range.
    WrongList Warning "wrong-list",
    /// A count differs from the number of entries.
    WrongCount Warning "wrong-count",
    /// An object that every device has.
    MissingMandatory Warning "missing-mandatory",
    /// `CompactSubObj` above 254, or on something other than an array.
    BadCompact Warning "bad-compact",
    /// Names or values of compact sub-objects that do not exist.
    CompactOrphan Warning "compact-orphan",
    /// A node ID that is not 1 to 127.
    BadNodeId Warning "bad-node-id",
}

/// One defect of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What kind it is.
    pub rule: Rule,
    /// Where.
    pub place: Place,
    /// What is wrong, in one sentence without a full stop.
    pub what: String,
    /// What was made of it, or what to do.
    pub advice: String,
}

impl Finding {
    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.rule.severity()
    }

    /// The message as compilers print theirs: `FILE:LINE:COL: warning: what; advice [rule]`.
    pub fn in_file<'a>(&'a self, file: &'a str) -> impl fmt::Display + 'a {
        InFile {
            finding: self,
            file,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.line > 0 {
            write!(f, "{}:{}: ", self.place.line, self.place.column)?;
        }
        let severity = self.severity().name();
        write!(
            f,
            "{severity}: {}; {} [{}]",
            self.what,
            self.advice,
            self.rule.name()
        )
    }
}

struct InFile<'a> {
    finding: &'a Finding,
    file: &'a str,
}

impl fmt::Display for InFile<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gap = if self.finding.place.line > 0 { "" } else { " " };
        write!(f, "{}:{gap}{}", self.file, self.finding)
    }
}

/// Findings that are kept; more are counted.
const MAX_FINDINGS: usize = 1_000;

/// Findings as they are collected.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    list: Vec<Finding>,
    dropped: u64,
    worst: Option<Severity>,
}

impl Findings {
    pub(crate) fn add(
        &mut self,
        rule: Rule,
        place: Place,
        what: impl Into<String>,
        advice: impl Into<String>,
    ) {
        self.worst = self.worst.max(Some(rule.severity()));
        if self.list.len() >= MAX_FINDINGS {
            self.dropped += 1;
            return;
        }
        self.list.push(Finding {
            rule,
            place,
            what: what.into(),
            advice: advice.into(),
        });
    }

    /// The severity of the worst, whether it was kept or not.
    pub(crate) fn worst(&self) -> Option<Severity> {
        self.worst
    }

    /// In the order of the file, and how many were not kept.
    pub(crate) fn finish(mut self) -> (Vec<Finding>, u64) {
        self.list.sort_by_key(|finding| finding.place);
        (self.list, self.dropped)
    }
}

/// A piece of the file as a message quotes it: not too long, on one line.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut shown: String = text
        .chars()
        .take(LONGEST)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push_str("...");
    }
    format!("\"{shown}\"")
}
