#!/bin/busybox sh
# The first program in the virtual machine: loads the modules, puts the host's files under a layer
# that is thrown away, runs /out/job.sh there as root, and switches off. No status in /out means
# that it did not get so far.
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
for module in $(cat /modules/order); do
    insmod /modules/$module || echo "module $module cannot be loaded"
done
options=trans=virtio,version=9p2000.L,msize=512000
mount -t 9p -o $options,ro,cache=loose host /host &&
    mount -t tmpfs layer /layer &&
    mkdir /layer/upper /layer/work &&
    mount -t overlay -o lowerdir=/host,upperdir=/layer/upper,workdir=/layer/work root /root &&
    mkdir -p /root/out &&
    mount -t 9p -o $options out /root/out || poweroff -f
mount -t proc proc /root/proc
mount -t sysfs sys /root/sys
mount -t devtmpfs dev /root/dev
# /tmp stays the host's, under the layer: the checkout may lie there.
mount -t tmpfs run /root/run
ip link set lo up
HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    chroot /root /bin/sh /out/job.sh </dev/null
echo $? >/root/out/status
sync
poweroff -f
