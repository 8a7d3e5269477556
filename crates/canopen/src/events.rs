//! What a call of the node has brought about, for its owner to act upon.

use crate::{Changed, NmtState, Reset};

/// What happened in a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Events {
    /// Classes of objects that were written.
    pub changed: Changed,
    /// A reset was asked for. The owner builds the node anew.
    pub reset: Option<Reset>,
    /// The NMT state was entered.
    pub entered: Option<NmtState>,
    /// A SYNC was received, or sent by this node, in a state that takes it.
    pub sync: bool,
    /// What else there is to look at.
    pub news: News,
}

impl Events {
    /// Nothing happened.
    pub const NOTHING: Events = Events {
        changed: Changed::NOTHING,
        reset: None,
        entered: None,
        sync: false,
        news: News::NOTHING,
    };
}

macro_rules! set {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $bit:ident = $n:literal;)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, PartialEq, Eq)]
        pub struct $name(u16);

        impl $name {
            /// None of them.
            pub const NOTHING: $name = $name(0);
            $($(#[$doc])* pub const $bit: $name = $name(1 << $n);)*

            /// Whether every one of `other` is among them.
            #[inline]
            pub const fn has(self, other: $name) -> bool {
                self.0 & other.0 == other.0
            }

            /// Whether there is none.
            #[inline]
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            #[inline]
            pub(crate) fn insert(&mut self, other: $name) {
                self.0 |= other.0;
            }
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let mut names = f.debug_set();
                $(if self.has($name::$bit) {
                    names.entry(&format_args!(stringify!($bit)));
                })*
                names.finish()
            }
        }
    };
}

set! {
    /// Rare news, each with where to look.
    News {
        /// The communication errors are others than before: [`crate::Node::errors`].
        ERRORS = 0;
        /// A TIME was received: [`crate::Node::time_of_day`].
        TIME = 1;
        /// An emergency of a node in 0x1028 was received: [`crate::Node::received_emergency`].
        EMERGENCY = 2;
        /// A node in 0x1016 was heard first, changed its state, booted anew or fell silent:
        /// [`crate::Node::monitored`].
        HEARTBEAT = 3;
    }
}

set! {
    /// Communication errors that are there now. Each has the emergency code of CiA 301 table 26
    /// that whoever keeps the error register may announce.
    CommunicationErrors {
        /// The last frame of a receive PDO was shorter than its mapping and was not applied: 0x8210.
        RPDO_TOO_SHORT = 0;
        /// The last frame of a receive PDO was longer than its mapping; its first bytes were
        /// applied: 0x8220.
        RPDO_TOO_LONG = 1;
        /// A receive PDO with an event timer (0x1400,5) has not come in time: 0x8250.
        RPDO_TIMEOUT = 2;
        /// The last SYNC had another length than 0x1019 says and was not obeyed: 0x8240.
        SYNC_LENGTH = 3;
        /// A node in 0x1016 has fallen silent: 0x8130.
        HEARTBEAT = 4;
        /// The master's guarding has ceased for longer than the life time: 0x8130.
        LIFE_GUARD = 5;
        /// The synchronous window (0x1007) closed before all PDOs of its SYNC were sent.
        SYNC_WINDOW = 6;
    }
}

impl CommunicationErrors {
    pub(crate) fn set(&mut self, error: CommunicationErrors, is: bool) {
        if is {
            self.0 |= error.0;
        } else {
            self.0 &= !error.0;
        }
    }
}
