//! Opening doors.

use super::Options;
use crate::interface::Interface;
use crate::{Endpoint, InterfaceError, Protocol};
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};

/// An open door, nobody behind it yet.
#[derive(Debug)]
pub(super) enum Opened {
    Listener(TcpListener),
    Interface(Interface),
}

/// Opens one door, with a runtime entered. Gives it and its address, with the port it really has.
pub(super) fn open(
    endpoint: &Endpoint,
    options: &Options,
) -> Result<(Opened, Endpoint), OpenError> {
    match endpoint.protocol() {
        Protocol::Socketcand | Protocol::Slcan => {
            let (listener, port) = listen(endpoint, options)?;
            Ok((Opened::Listener(listener), endpoint.with_port(port)))
        }
        Protocol::SocketCan => {
            let interface = Interface::open(endpoint.channel())?;
            Ok((Opened::Interface(interface), endpoint.clone()))
        }
    }
}

/// Why doors could not be opened. None is open then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The address can be reached by other machines, and nobody asked for that.
    #[error(
        "{endpoint} could be reached by other machines, and whoever reaches it is on the bus: \
         listen on 127.0.0.1, or allow it by --expose"
    )]
    Public {
        /// The endpoint asked for.
        endpoint: Endpoint,
    },
    /// The host name means nothing here.
    #[error("cannot listen on {endpoint}: no address belongs to '{host}' ({source}); use 127.0.0.1",
        host = endpoint.host())]
    Unresolved {
        /// The endpoint asked for.
        endpoint: Endpoint,
        /// What the resolver says.
        source: io::Error,
    },
    /// Another program listens there.
    #[error(
        "cannot listen on {endpoint}: the port is in use; end the program that uses it, or choose \
         another port (0 takes a free one)"
    )]
    InUse {
        /// The endpoint asked for.
        endpoint: Endpoint,
    },
    /// The system refuses for another reason.
    #[error("cannot listen on {endpoint}: {source}; {hint}", hint = hint(source))]
    Listen {
        /// The endpoint asked for.
        endpoint: Endpoint,
        /// What the system says.
        source: io::Error,
    },
    /// The interface of this machine cannot be used.
    #[error(transparent)]
    Interface(#[from] InterfaceError),
    /// The thread that keeps the sockets could not be started.
    #[error("cannot start the thread for the bus's connections: {source}; are there too many?")]
    Thread {
        /// What the system says.
        source: io::Error,
    },
}

fn hint(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::PermissionDenied => "choose a port from 1024 upwards",
        ErrorKind::AddrNotAvailable => "use an address of this machine",
        _ => "choose another address",
    }
}

/// Why an address cannot be listened on.
#[derive(Debug)]
pub(crate) enum BindError {
    /// Other machines can reach it, and nobody asked for that.
    Public,
    /// The host name means nothing here.
    Unresolved(io::Error),
    /// Another program listens there.
    InUse,
    /// The system refuses for another reason.
    Other {
        source: io::Error,
        hint: &'static str,
    },
}

/// Listens there; gives the socket and its port.
fn listen(endpoint: &Endpoint, options: &Options) -> Result<(TcpListener, u16), OpenError> {
    let endpoint_of = || endpoint.clone();
    bind(endpoint.host(), endpoint.port(), options.public).map_err(|error| match error {
        BindError::Public => OpenError::Public {
            endpoint: endpoint_of(),
        },
        BindError::Unresolved(source) => OpenError::Unresolved {
            endpoint: endpoint_of(),
            source,
        },
        BindError::InUse => OpenError::InUse {
            endpoint: endpoint_of(),
        },
        BindError::Other { source, .. } => OpenError::Listen {
            endpoint: endpoint_of(),
            source,
        },
    })
}

/// Listens at a host and a port, unless other machines could reach it and that is not wanted.
pub(crate) fn bind(host: &str, port: u16, public: bool) -> Result<(TcpListener, u16), BindError> {
    let mut addresses: Vec<SocketAddr> = (host, port)
        .to_socket_addrs()
        .map_err(BindError::Unresolved)?
        .collect();
    if !public
        && !addresses
            .iter()
            .all(|at| at.ip().to_canonical().is_loopback())
    {
        return Err(BindError::Public);
    }
    // Several for a name: IPv4 first, which all clients can. Only one is tried, or a busy port
    // would quietly move the door to another address.
    addresses.sort_by_key(SocketAddr::is_ipv6);
    let address = addresses
        .first()
        .ok_or_else(|| BindError::Unresolved(ErrorKind::NotFound.into()))?;
    let listener = TcpListener::bind(address).and_then(|listener| {
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        Ok((listener, port))
    });
    listener.map_err(|source| match source.kind() {
        ErrorKind::AddrInUse => BindError::InUse,
        _ => BindError::Other {
            hint: hint(&source),
            source,
        },
    })
}
