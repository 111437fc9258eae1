#!/usr/bin/env bash
# Runs a command in a clone of HEAD on a bare Debian: a fresh root folder of debootstrap (minbase) in which only git is
# installed. Shows that a machine that has nothing else suffices. Prints the times, and exits as the command does.
# Usage: ci/bare.sh [--keep] [--suite NAME] [--with PATH] COMMAND...
#   e.g. ci/bare.sh ci/test.sh; ci/bare.sh --suite trixie --with dist ci/demo.sh
#   --keep         leaves the root folder behind, and prints where it is
#   --suite NAME   Debian's name of the release (default: bookworm, which is Debian 12)
#   --with PATH    what git ignores, and goes into the clone: packages
# CUTPROOF_BARE_CACHE: a folder in which the root folder is kept as an archive before the clone, for the next time.
# TMPDIR: where the root folder is made (default: /var/tmp); ci/test.sh needs 10 GB there.
# Needs root and debootstrap. Debian's packages come from where this machine has them.
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

# Repositories of this machine that are Debian's; its keys are in the root folder, too.
repositories=$(apt-get indextargets --format '$(ORIGIN) $(REPO_URI) $(RELEASE)' 'Created-By: Packages' 2>/dev/null |
  awk -v suite="$suite" '$1 == "Debian" && $3 ~ "^" suite { print "deb", $2, $3, "main" }' | sort -u)
mirror=$(awk -v suite="$suite" '$3 == suite { print $2; exit }' <<< "$repositories")
if [ -z "$mirror" ]; then
  mirror=http://deb.debian.org/debian
  repositories="deb $mirror $suite main"
fi

root=$(mktemp -d "${TMPDIR:-/var/tmp}/cutproof_bare_XXXXXX")
job=
# Mounts are made by the job, in a namespace that ends with it: nothing outside the folder can be removed here.
finish() {
  [ -z "$job" ] || { kill -KILL "$job" && wait "$job"; } 2>/dev/null || true
  if [ "$keep" = yes ]; then echo "ci/bare.sh: kept: $root"; else rm -rf --one-file-system "$root"; fi
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
# Waits for a command that SIGINT does not reach, and whose processes end with it, whatever they do.
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
rm -f "$root/etc/hosts"  # so that nothing may count on names
git -c safe.directory="$PWD" clone -q --no-local "file://$PWD" "$root/root/cutproof"
[ -z "$with" ] || cp -a --parents "$with" "$root/root/cutproof/"
made=$((SECONDS - begin))

# Nothing of this shell gets in but how the network is reached.
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
