//! The tests that need a kernel with CAN, in a virtual machine that has one: QEMU without hardware
//! acceleration, so that it runs anywhere, Debian's kernel, and this machine's own files under a
//! layer that is thrown away, so that every program here runs in there as it is.
//!
//! The machine has two Kvaser controllers on one emulated bus, and a serial line that leads to the
//! slcan door of virtual drives on the host.

mod archive;
mod image;
mod slcan_host;

use std::fs;
use std::path::Path;

use crate::command::{quoted, run as run_command};
use crate::outside::judge_pytest;
use crate::step::{StepResult, Trouble};
use crate::transcripts::build_servobus;
use crate::workspace::Workspace;
use crate::{apt, python};
use image::Image;
use slcan_host::SlcanHost;

const QEMU: &str = "qemu-system-x86_64";
const TESTS: &str = "python/vm";
/// Seconds after which a machine that does not end is ended.
const LONGEST: &str = "300";

/// can-utils, python-can, python-canopen and the kernel's own drivers against servobus.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    if cfg!(not(all(target_os = "linux", target_arch = "x86_64"))) {
        return Err(Trouble::impossible(
            "the virtual machine runs programs of x86-64 Linux",
            "run this on such a machine",
        ));
    }
    apt::need(QEMU, &["qemu-system-x86"])?;
    apt::need("candump", &["can-utils"])?;
    apt::need("ip", &["iproute2"])?;
    let python = python::environment(workspace, python::OUTSIDE)?;
    build_servobus(workspace)?;
    let image = image::ready(workspace)?;
    let out = workspace.target().join("vm").join("out");
    let broken = |error: std::io::Error| Trouble::Failed(format!("{}: {error}", out.display()));
    // An earlier run's results must not pass for this one's.
    let _ = fs::remove_dir_all(&out);
    fs::create_dir_all(&out).map_err(broken)?;
    fs::write(out.join("job.sh"), job(workspace, &python)).map_err(broken)?;

    let host = SlcanHost::start(workspace, &out)?;
    let output = boot(workspace, &image, &host, &out);
    host.end()?;
    let output = output?;
    let status = fs::read_to_string(out.join("status"));
    match status.as_deref().map(str::trim) {
        Ok(status) => {
            let counts = judge_pytest(&output, status == "0", &out)?;
            came_through(&out)?;
            Ok(format!("{counts}, on Linux {}", image.version))
        }
        Err(_) => Err(Trouble::failed(
            "the virtual machine did not get to the end of its tests; its words are above",
        )),
    }
}

/// What the machine does when it has started. In there, the host's files are where they are here.
fn job(workspace: &Workspace, python: &Path) -> String {
    let path = |path: &Path| quoted(&path.to_string_lossy());
    format!(
        "cd {root} || exit 9\n\
         export SERVOBUS={servobus} SERVOBUS_OUTSIDE_DIR=/out SLCAN_SERIAL=/dev/ttyS1\n\
         export PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1\n\
         {python} -m pytest -p no:cacheprovider -ra --color no --durations 5 {TESTS}\n",
        root = path(workspace.root()),
        servobus = path(&workspace.servobus()),
        python = path(python),
    )
}

/// What `python/vm/test_slcan.py` sends through the kernel's slcan driver, as it must be in the
/// recording of the host's drives.
const THROUGH_SLCAN: [&str; 3] = ["666#R4", "1ABCDEF0#R", "1ABCDEF0#0102030405060708"];

fn came_through(out: &Path) -> Result<(), Trouble> {
    let log = out.join(slcan_host::LOG);
    let text = fs::read_to_string(&log)
        .map_err(|error| Trouble::Failed(format!("{}: {error}", log.display())))?;
    let frames: Vec<&str> = text
        .lines()
        .filter_map(|line| line.rsplit(' ').next())
        .filter(|frame| THROUGH_SLCAN.contains(frame))
        .collect();
    if frames == THROUGH_SLCAN {
        Ok(())
    } else {
        Err(Trouble::Failed(format!(
            "{}: of {THROUGH_SLCAN:?} there came {frames:?}",
            log.display()
        )))
    }
}

/// Runs the machine until it switches itself off; gives what it printed.
fn boot(
    workspace: &Workspace,
    image: &Image,
    host: &SlcanHost,
    out: &Path,
) -> Result<String, Trouble> {
    let mut qemu = workspace.command("timeout");
    qemu.args([LONGEST, QEMU, "-M", "pc", "-accel", "tcg"]);
    qemu.args(["-smp", "2", "-m", "768", "-nodefaults", "-display", "none"]);
    qemu.args(["-no-reboot", "-serial", "stdio"]);
    qemu.arg("-kernel").arg(&image.kernel);
    qemu.arg("-initrd").arg(&image.initial);
    qemu.args(["-append", "console=ttyS0 quiet panic=-1"]);
    qemu.args([
        "-fsdev",
        "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap",
    ]);
    qemu.args(["-device", "virtio-9p-pci,fsdev=host,mount_tag=host"]);
    // A comma in a name is written twice.
    let shared = out.to_string_lossy().replace(',', ",,");
    qemu.arg("-fsdev")
        .arg(format!("local,id=out,path={shared},security_model=none"));
    qemu.args(["-device", "virtio-9p-pci,fsdev=out,mount_tag=out"]);
    qemu.args(["-object", "can-bus,id=pair"]);
    qemu.args(["-device", "kvaser_pci,canbus=pair"]);
    qemu.args(["-device", "kvaser_pci,canbus=pair"]);
    // The door lets nobody in who takes long to join: then the line comes back.
    qemu.arg("-chardev").arg(format!(
        "socket,id=slcan,host=127.0.0.1,port={},nodelay=on,reconnect=1",
        host.port()
    ));
    qemu.args(["-serial", "chardev:slcan"]);
    let ended = run_command(&mut qemu)?;
    if ended.status.success() {
        Ok(ended.output)
    } else {
        Err(Trouble::Failed(format!(
            "the virtual machine ended with {} (124: not within {LONGEST} s)",
            ended.status
        )))
    }
}
