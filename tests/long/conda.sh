#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# conda.sh: conda/meta.yaml as conda-build reads it, its build.sh on a copy of the source, and its test commands
# on what that installed. Where conda's compilers and libraries would be, it takes the machine's: it needs no
# network, and does not show that conda-forge's versions fit.
. "$(dirname "$0")/lib.sh"
row 'recipe, build, its test commands'
for PY in python3 /usr/bin/python3; do "$PY" -c 'import jinja2, yaml' 2>/dev/null && break; PY=; done
[ "$PY" ] || { echo '# conda: skipped: no python3-jinja2 and python3-yaml'; finish; }
cat >read.py <<'EOF'
import re
import sys

import jinja2
import yaml

text = ''.join(line for line in open(sys.argv[1]) if not re.search(r'# \[(win|osx)\]', line))
known = {name: lambda *words, name=name, **more: f'{name} {words}' for name in ('compiler', 'stdlib', 'pin_subpackage', 'pin_compatible')}
recipe = yaml.safe_load(jinja2.Environment(undefined=jinja2.StrictUndefined).from_string(text).render(**known))
assert set(recipe) == {'package', 'source', 'build', 'requirements', 'test', 'about'}, set(recipe)
assert f"AC_INIT([ctsr], [{recipe['package']['version']}]" in open(sys.argv[2]).read(), 'not the version of configure.ac'
assert recipe['source']['path'] == '..' and recipe['about']['license'] == 'Apache-2.0'
print('\n'.join(recipe['test']['commands']))
EOF
"$PY" read.py "$srcdir/conda/meta.yaml" "$srcdir/configure.ac" >commands 2>err; tally $? 'the recipe'
mkdir source && (cd "$srcdir" && git ls-files -z 2>/dev/null | tar --null -T - -cf -) | tar -C source -xf - ||
	{ echo '# conda: skipped: no checkout'; finish; }
export PREFIX="$work/prefix" CPU_COUNT=2
(cd source && sh conda/build.sh) >log 2>&1
status=$?; tail -n 3 log >err; tally $status 'conda/build.sh'
(PATH=$PREFIX/bin:$PATH && [ "$(command -v ct-sr)" = "$PREFIX/bin/ct-sr" ] && sh -e commands) >log 2>err
tally $? 'the commands of the test'
finish
