#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# _boot.sh ROOT - boots the systemd of a root file system, alone in the world: its own processes, mounts,
# control groups and network (loopback only); /proc/sys and /sys of the machine can be read. Ends when
# systemd does; kill it, and everything in there ends.
set -eu
ROOT=$1
if [ "${2:-}" != inside ]; then
    group=$(findmnt -n -t cgroup2 -o TARGET | head -n 1)/bcdd-test-$$
    mkdir "$group"
    echo $$ >"$group/cgroup.procs"
    exec unshare --mount --pid --fork --kill-child --uts --ipc --net --cgroup sh "$0" "$ROOT" inside
fi
mount --make-rprivate /
mount --bind "$ROOT" "$ROOT"
cd "$ROOT"
mount -t proc proc proc
mount --bind proc/sys proc/sys
mount -o remount,bind,ro proc/sys
mount -t sysfs -o ro sysfs sys
mount -t cgroup2 cgroup2 sys/fs/cgroup
mount -t tmpfs tmpfs run
mount -t tmpfs tmpfs dev
for device in null zero full random urandom; do
    : >"dev/$device"
    mount --bind "/dev/$device" "dev/$device"
done
mkdir dev/shm dev/pts
mount -t tmpfs tmpfs dev/shm
mount -t devpts -o ptmxmode=666 devpts dev/pts
ln -s pts/ptmx dev/ptmx
ip link set lo up
mkdir -p .before
pivot_root . .before
umount -l .before
container=bcdd-test
export container
exec /lib/systemd/systemd --log-target=null systemd.unit=multi-user.target
