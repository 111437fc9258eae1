#!/usr/bin/env bash
# Runs a command in a clone of HEAD on a bare Debian: a fresh root folder by debootstrap (minbase) with git as the only
# addition. Shows that such a machine suffices. Prints the times, and exits as the command does.
# Usage: ci/bare.sh [--keep] [--suite NAME] [--with PATH] COMMAND...
#   e.g. ci/bare.sh ci/test.sh; ci/bare.sh --suite trixie --with dist ci/demo.sh
#   --keep         keeps the root folder, and prints its path
#   --suite NAME   Debian's name of the release (default: bookworm, which is Debian 12)
#   --with PATH    also copies a path that git ignores, such as packages, into the clone
# CUTPROOF_BARE_CACHE: a folder that keeps the root folder, as it is before the clone, as an archive for later runs.
# TMPDIR: parent of the root folder (default: /var/tmp); ci/test.sh needs 10 GB there.
# Needs root and debootstrap. Packages come from this machine's Debian repositories.
set -euo pipefail
cd "$(dirname "$0")/.."
refuse() { echo "ci/bare.sh: $1" >&2; exit 2; }

keep=no suite=bookworm with=
while true; do
  case ${1:-} in
    --keep) keep=yes; shift; continue ;;
    --suite) suite=${2:-} ;;
    --with) with=${2:-} ;;
    *) break ;;
  esac
  [ $# -ge 2 ] || refuse "$1: its value is missing"
  shift 2
done
[ -z "$with" ] || [ -e "$with" ] || refuse "--with: there is no $with here"
[ $# -gt 0 ] && [[ $1 != -* ]] || refuse "the command is missing: ci/bare.sh [--keep] [--suite NAME] [--with PATH] COMMAND..."
[ "$(id -u)" -eq 0 ] || refuse "only root can make another root folder: run it with sudo"
for tool in debootstrap unshare git; do
  command -v "$tool" >/dev/null || refuse "$tool is missing: apt-get install $tool"
done
[ -z "$(git status --porcelain)" ] || echo "ci/bare.sh: changes that are not committed are left out" >&2

# This machine's Debian repositories; the root folder has Debian's keys, too.
repositories=$(apt-get indextargets --format '$(ORIGIN) $(REPO_URI) $(RELEASE)' 'Created-By: Packages' 2>/dev/null |
  awk -v suite="$suite" '$1 == "Debian" && $3 ~ "^" suite { print "deb", $2, $3, "main" }' | sort -u)
mirror=$(awk -v suite="$suite" '$3 == suite { print $2; exit }' <<< "$repositories")
if [ -z "$mirror" ]; then
  mirror=http://deb.debian.org/debian
  repositories="deb $mirror $suite main"
fi

root=$(mktemp -d "${TMPDIR:-/var/tmp}/cutproof_bare_XXXXXX")
job=
# The job makes mounts in a namespace that ends with it, so this can remove nothing outside the folder.
finish() {
  [ -z "$job" ] || { kill -KILL "$job" && wait "$job"; } 2>/dev/null || true
  if [ "$keep" = yes ]; then echo "ci/bare.sh: kept: $root"; else rm -rf --one-file-system "$root"; fi
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
# Waits for a command that SIGINT does not reach, and whose processes all end with it.
set -m
run() {
  unshare --mount --pid --fork --kill-child "$@" < /dev/null &
  job=$!
  local status=0
  wait "$job" || status=$?
  job=
  return "$status"
}

begin=$SECONDS
kept=${CUTPROOF_BARE_CACHE:+$CUTPROOF_BARE_CACHE/${suite}_$(dpkg --print-architecture).tar}
if [ -n "$kept" ] && [ -e "$kept" ]; then
  run tar -xpf "$kept" -C "$root"
else
  log=$root.log
  run debootstrap --variant=minbase --include=git "$suite" "$root" "$mirror" > "$log" 2>&1 ||
    { tail -5 "$log" >&2; rm "$log"; echo "ci/bare.sh: debootstrap failed" >&2; exit 3; }
  rm "$log"
  if [ -n "$kept" ]; then
    mkdir -p "$CUTPROOF_BARE_CACHE"
    tar -cpf "$kept.new" -C "$root" . && mv "$kept.new" "$kept"
  fi
fi
chmod 755 "$root"
echo "$repositories" > "$root/etc/apt/sources.list"
apt-config dump Acquire | grep -iE '^Acquire::[a-z]+::Proxy(::|-| )' > "$root/etc/apt/apt.conf.d/90proxy" || true
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
rm -f "$root/etc/hosts"  # so that nothing can depend on names
git -c safe.directory="$PWD" clone -q --no-local "file://$PWD" "$root/root/cutproof"
[ -z "$with" ] || cp -a --parents "$with" "$root/root/cutproof/"
made=$((SECONDS - begin))

# Only this shell's network settings are passed on.
surroundings=(HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8)
for name in http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY; do
  [ -z "${!name:-}" ] || surroundings+=("$name=${!name}")
done
begin=$SECONDS
status=0
run bash -c '
  root=$1
  shift
  mount --rbind /dev "$root/dev" && mount --rbind /sys "$root/sys" && mount -t proc proc "$root/proc" || exit 3
  exec chroot "$root" env -i "$@"' mounting "$root" "${surroundings[@]}" \
  bash -c 'cd /root/cutproof && "$@"' bare "$@" || status=$?
echo "ci/bare.sh: $made s for a bare Debian ($suite), $((SECONDS - begin)) s for $*, which ended with status $status"
exit "$status"
