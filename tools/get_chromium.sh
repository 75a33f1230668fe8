#!/bin/sh
# Brings Debian's Chromium for the tests in a browser, as root; without it these tests are skipped.
set -eu
for browser in chromium chromium-browser google-chrome; do
    command -v "$browser" >/dev/null 2>&1 && exit 0
done
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "chromium is missing: installing it"
    apt-get update -qq
    # what it recommends serves a desktop (printers, notifications): 89 packages more
    apt-get install -y -qq --no-install-recommends chromium fonts-liberation
else
    echo "no Chromium here, and not root: the tests in a browser will be skipped"
fi
