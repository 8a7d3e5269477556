//! One drive's control period: the P3's loops, then five PWM periods of its motor.

use canopen::{Instant, NodeId};
use control::io::Duty;
use drive::{Drive, Hardware, Health};
use plant::{Parameters, Plant};

/// A P3 in a world of `parameters` that turns its motor at 2,000 rpm, in the velocity loop; each call
/// is one control period.
pub(crate) fn new(parameters: &Parameters) -> impl FnMut() -> Duty<f32> + use<> {
    let personality = &personalities::p3::P3;
    let mut plant = Plant::<f32>::new(parameters);
    let hardware = Hardware {
        scales: parameters.scales,
        duty_margin: 0.0,
    };
    let memory = vec![0; personality.device.table.image_bytes()];
    let id = NodeId::new(1).expect("a node ID from 1 to 127");
    let made = Drive::new(personality, hardware, memory, id, 1, &[], Health::default());
    let (mut drive, _) = made.expect("the P3's defaults make a drive");
    plant.set_timer_dead_time_s(f64::from(drive.timing().dead_time_ns) * 1e-9);
    let mut now = Instant::ZERO;
    drive.start(now);
    // 0x6040 = 0x86, 0x0F; 0x6060 = 3; 0x60FF = 136,533 counts/s.
    let speed = 136_533i32.to_le_bytes();
    let requests: [&[u8]; 4] = [
        &[0x22, 0x40, 0x60, 0, 0x86, 0],
        &[0x22, 0x40, 0x60, 0, 0x0F, 0],
        &[0x22, 0x60, 0x60, 0, 3],
        &[0x22, 0xFF, 0x60, 0, speed[0], speed[1], speed[2], speed[3]],
    ];
    for request in requests {
        let mut bytes = [0; 8];
        bytes[..request.len()].copy_from_slice(request);
        drive.receive(
            &can::Frame::classic(0x601, bytes, request.len() as u8),
            now,
            &mut drive::NoHost,
        );
    }
    let mut period = move |drive: &mut Drive<Vec<u8>>| {
        let duty = drive.control_period(&plant.sample(), &plant.signals());
        plant.load(&duty);
        plant.run(u32::from(personality.axes[0].amplifier.pwm_per_control));
        duty
    };
    // Up to speed: half a second.
    for _ in 0..10_000 {
        period(&mut drive);
        now = now.plus_us(50);
        drive.poll(now, &mut drive::NoHost);
    }
    let velocity = drive.feedback().velocity_reported;
    assert!((velocity - 136_533.0).abs() < 5_000.0, "{velocity}");
    move || period(&mut drive)
}
