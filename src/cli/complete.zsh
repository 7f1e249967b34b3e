#compdef @TOOL@
# @TOOL@ in zsh: the command itself says what may stand at the cursor.
local kind tab=$'\t'
local -a got how
got=("${(@f)$($words[1] --complete "${(@Q)words[2,CURRENT - 1]}" "${(Q)PREFIX}" 2>/dev/null)}")
kind=$got[1]
shift got
[[ $PREFIX == -* ]] && how=(-o)
[[ $PREFIX == --*=* ]] && compset -P '*=' && how=()
case $kind in
words)
	got=("${(@)got//:/\\:}")
	got=("${(@)got/=$tab/$tab}")
	got=("${(@)got/$tab/:}")
	_describe $how @TOOL@ got
	;;
folder) _files -/ ;;
files) _files ;;
files*) _files -g "*.(#i)(${kind#files })(-.)" ;;
esac
