#!/bin/sh
# The first hour on a bare Debian: the README's run command, then whatever its one sentence says, until the window is open.
#
#     sh tests/bare_root.sh [FOLDER]
#
# Makes a root in FOLDER (default: a temporary one, removed at the end) that holds Python and its venv alone. Needs to be
# root, debootstrap, Xvfb, xdotool and a way to Debian's mirror and PyPI; how this machine reaches them is copied.
set -eu
project=$(cd "$(dirname "$0")/.." && pwd)
for tool in debootstrap Xvfb xdotool chroot; do
    command -v "$tool" >/dev/null || { echo "bare_root: $tool is missing" >&2; exit 2; }
done
[ "$(id -u)" -eq 0 ] || { echo "bare_root: must run as root" >&2; exit 2; }

root=${1:-$(mktemp -d)}
log=$(mktemp -d)
xvfb=
window=
cleanup() {
    if [ -n "$window" ]; then
        kill -- "-$window" 2>/dev/null || true
        # What the window started may still be compiling; nothing may hold the root when it is taken down.
        while kill -0 -- "-$window" 2>/dev/null; do sleep 0.2; done
    fi
    [ -z "$xvfb" ] || kill "$xvfb" 2>/dev/null || true
    for place in tmp/.X11-unix dev proc; do
        # What just ended may hold a place for a moment more.
        tries=0
        while mountpoint -q "$root/$place" && ! umount "$root/$place" 2>/dev/null; do
            tries=$((tries + 1))
            [ "$tries" -lt 50 ] || { umount -l "$root/$place"; break; }
            sleep 0.2
        done
    done
    [ -n "${kept:-}" ] || rm -rf --one-file-system "$root"
    rm -rf "$log"
}
kept=${1:+yes}
trap cleanup EXIT
trap 'exit 1' INT TERM

# The release, mirror and settings of this machine.
suite=$(. /etc/os-release && echo "${VERSION_CODENAME:-stable}")
mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' 'Label: Debian' 2>/dev/null | head -n 1)
[ -x "$root/usr/bin/python3" ] || debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates \
    "$suite" "$root" ${mirror:+"$mirror"} >"$log/debootstrap" 2>&1 || { tail -n 5 "$log/debootstrap" >&2; exit 1; }
cp /etc/resolv.conf /etc/hosts "$root/etc/"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
[ ! -f /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/"
for settings in $(grep -lis proxy /etc/apt/apt.conf /etc/apt/apt.conf.d/* || true); do
    cp "$settings" "$root/etc/apt/apt.conf.d/"
done
passed=$(env | grep -E '^([a-z]+_proxy|[A-Z]+_PROXY|PIP_(CERT|PROXY|INDEX_URL|DEFAULT_TIMEOUT)|SSL_CERT_FILE)=' || true)

rm -rf "$root/src" "$root/root/.cache/splap-editor"
mkdir -p "$root/src" "$root/tmp/.X11-unix"
(cd "$project" && git ls-files -z | xargs -0 tar -cf -) | tar -xf - -C "$root/src"
mount --bind /proc "$root/proc"
mount --bind /dev "$root/dev"

mkfifo "$log/display"
Xvfb -displayfd 3 -screen 0 1440x900x24 -nolisten tcp 3>"$log/display" 2>/dev/null &
xvfb=$!
read -r display <"$log/display"
mount --bind /tmp/.X11-unix "$root/tmp/.X11-unix"

within() {
    # A group of its own, so that all of it can be ended.
    # shellcheck disable=SC2086 # one setting a word
    exec setsid env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        DISPLAY=":$display" $passed chroot "$root" sh -c "cd /src && $1"
}
fail() {
    echo "bare_root: $1" >&2
    [ ! -f "$log/err" ] || cat "$log/err" >&2
    exit 1
}

command=$(sed -n '/^## Run it/,/^## /{/^```sh/,/^```$/{/^```/!p}}' "$project/README.md" | head -n 1)
for try in 1 2 3; do
    echo "\$ $command"
    within "$command" >"$log/out" 2>"$log/err" &
    window=$!
    waited=0
    until found=$(DISPLAY=":$display" xdotool search --onlyvisible --name 'SpLap Editor' 2>/dev/null); do
        kill -0 "$window" 2>/dev/null || break
        waited=$((waited + 1))
        [ "$waited" -lt 900 ] || fail "no window after 900 seconds"
        sleep 1
    done
    if [ -n "$found" ]; then
        sleep 5
        kill -0 "$window" 2>/dev/null || fail "the window did not stay"
        ! grep -q Traceback "$log/err" || fail "the window is open, with a traceback"
        echo "the window is open: $(DISPLAY=":$display" xdotool getwindowname "${found%%
*}")"
        (within ".venv/bin/splap-editor doctor")
        exit 0
    fi
    code=0
    wait "$window" || code=$?
    window=
    grep -v -e '^WARNING' -e '^note' "$log/err" >"$log/sentence" || true
    cat "$log/sentence"
    [ "$code" -eq 2 ] && [ "$(wc -l <"$log/sentence")" -eq 1 ] || fail "exit code $code and not one sentence"
    cure=$(sed -n 's/.* with: //p' "$log/sentence")
    [ -n "$cure" ] || fail "the sentence names no line"
    echo "\$ $cure"
    yes | (within "$cure" >"$log/cure" 2>&1) || { tail -n 5 "$log/cure" >&2; fail "the line does not work"; }
    command=.venv/bin/splap-editor
done
fail "after following $try sentences there is no window"
