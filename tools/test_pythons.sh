#!/bin/sh
# Builds sdist and wheel twice, the same to the byte; installs each in an empty environment and runs the README's blocks
# there; and installs the wheel with its extras for every Python from 3.11 on that this machine has, and runs tests there.
set -eu
cd "$(dirname "$0")/.."

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# the wheel is made from the sdist, so that what the sdist lacks is noticed
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
git clone --quiet . "$folder/clone"
for source in . "$folder/clone"; do
    .venv/bin/python -m build --outdir "$source/build/release" "$source" >/dev/null
done
for file in "$folder"/clone/build/release/*; do
    cmp "$file" "build/release/${file##*/}"
    sha256sum "build/release/${file##*/}"
done
wheel=$(ls "$folder"/clone/build/release/*.whl)

block() { # LANGUAGE: the block of the README in it
    sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/{/^\`\`\`/d;p}" README.md
}
for file in "$folder"/clone/build/release/*; do
    empty="$folder/empty-${file##*.}"
    .venv/bin/python -m venv "$empty"
    "$empty/bin/pip" install --quiet --disable-pip-version-check "$file"
    mkdir -p "$empty/work/src/hotlever"
    cp -r src/hotlever/examples "$empty/work/src/hotlever"
    block python >"$empty/work/block.py"
    block sh >"$empty/work/block.sh"
    (
        cd "$empty/work"
        PATH="$empty/bin:$PATH" HOTLEVER_CACHE="$empty/cache"
        export PATH HOTLEVER_CACHE
        python -I block.py >out.txt
        sh -eu block.sh >>out.txt 2>&1
    ) || { tail -n 20 "$empty/work/out.txt" >&2; exit 1; }
    echo "README's blocks run with ${file##*/}"
done

tested=
for python in $(
    { which -a python3.11 python3.12 python3.13 python3.14 || true
      ls "${PYENV_ROOT:-$HOME/.pyenv}"/versions/*/bin/python3.1[1-9] 2>/dev/null || true; }
); do
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) || continue
    case " $tested " in *" $version "*) continue ;; esac
    "$python" -m venv "$folder/$version" >/dev/null 2>&1 || { echo "Python $version makes no venv"; continue; }
    "$folder/$version/bin/pip" install --quiet --disable-pip-version-check "$wheel[app,raman,cluster,test]"
    echo "Python $version"
    "$folder/$version/bin/python" -m pytest -q -p no:cacheprovider -n 2 --dist loadfile \
        tests/materials tests/probe tests/measurement tests/test_cli.py tests/test_package.py \
        tests/test_processes.py tests/test_readme.py
    tested="$tested $version"
done
[ -n "$tested" ] || { echo "no Python from 3.11 on was found" >&2; exit 1; }
echo "tested:$tested"
