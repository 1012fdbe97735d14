#!/usr/bin/env bash
# The page in headless Chromium, served by the program: skipped, saying so, where a tool is missing.
#
# usage: browser.sh [FOLDER]   with a folder, pictures for README and docs are left there.
set -euo pipefail
cd "$(dirname "$0")/../../.."

chromium="${CHROMIUM:-/usr/bin/chromium}"
if [ ! -x "$chromium" ] || ! command -v node >/dev/null || ! command -v npm >/dev/null; then
    echo "skipped: the browser tests need Node.js, npm and Chromium (Debian: chromium)"
    exit 0
fi
tools="$(realpath "${CARGO_TARGET_DIR:-target}")/browser-tests"
mkdir -p "$tools"
if [ ! -d "$tools/node_modules/playwright-core" ] &&
    ! npm install --silent --no-fund --no-audit --prefix "$tools" playwright-core@1.65.1; then
    echo "skipped: npm could not install playwright-core"
    exit 0
fi
cp apps/web/tests/*.mjs "$tools/"

cargo build --release --locked --quiet --bin guidedog
GUIDEDOG="$(realpath "${CARGO_TARGET_DIR:-target}")/release/guidedog"
export GUIDEDOG
log="$(mktemp)"
"$GUIDEDOG" play --no-open >"$log" 2>/dev/null &
server=$!
trap 'kill "$server"; rm -f "$log"' EXIT
for _ in $(seq 50); do
    [ -s "$log" ] && break
    sleep 0.1
done
CHROMIUM="$chromium" node "$tools/browser.mjs" "$(head -n 1 "$log")" "$@"
