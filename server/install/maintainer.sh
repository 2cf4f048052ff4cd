#!/bin/sh
# postinst, prerm and postrm of the Debian package. deb-systemd-helper enables the unit also where systemd does not run;
# there nothing is started.
set -e

unit=impactd.service
systemd() {
    [ ! -d /run/systemd/system ] || "$@" >/dev/null || true
}

case "${DPKG_MAINTSCRIPT_NAME:-${0##*.}} $1" in
"postinst configure" | "postinst abort-"*)
    adduser --quiet --system --group --no-create-home --home /var/lib/impactd impactd
    deb-systemd-helper unmask $unit >/dev/null || true
    if deb-systemd-helper --quiet was-enabled $unit; then
        deb-systemd-helper enable $unit >/dev/null || true
    else
        deb-systemd-helper update-state $unit >/dev/null || true
    fi
    systemd systemctl --system daemon-reload
    systemd deb-systemd-invoke "$([ -n "$2" ] && echo restart || echo start)" $unit
    ;;
"prerm remove")
    systemd deb-systemd-invoke stop $unit
    ;;
"postrm remove")
    systemd systemctl --system daemon-reload
    ;;
"postrm purge")
    # The user stays: files of it elsewhere must not become another user's.
    rm -rf /var/lib/impactd
    deb-systemd-helper purge $unit >/dev/null || true
    ;;
esac
