# SPDX-License-Identifier: Apache-2.0
# What tests of pictures begin with: ct-view, NumPy and Pillow, and questions to what a test writes
# into look.py.
. "$srcdir/tests/tap.sh"
python_with numpy,PIL.Image || { echo '1..0 # SKIP no numpy or Pillow'; exit 0; }
py() { # py STATEMENTS: of what look.py knows
	"$PY" -B -c "from look import *
$1"
}
is() { # is EXPRESSION NAME
	py "raise SystemExit(not ($1))" >err 2>&1 && rc=0 || rc=1
	ok $rc "$2"
	[ $rc -eq 0 ] || { echo "$1"; cat err; } | sed 's/^/# /'
}
