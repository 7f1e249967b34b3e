# @TOOL@ in bash: the command itself says what may stand at the cursor.
_ctsr()
{
	local w i kind ends
	local -a line=() got
	COMPREPLY=()
	for ((i = 0; i <= COMP_CWORD; i++)); do # readline cuts words at = and :
		w=${COMP_WORDS[i]}
		if ((i > 1)) && [[ $w == [=:]* || ${COMP_WORDS[i - 1]} == [=:] ]]; then
			line[${#line[@]} - 1]+=$w
		else
			line+=("$w")
		fi
	done
	w=${line[${#line[@]} - 1]}
	mapfile -t got < <("${line[0]}" --complete "${line[@]:1}" 2>/dev/null)
	kind=${got[0]}
	[[ $w == --*=* ]] && w=${w#*=}
	if [[ $kind == words ]]; then
		for i in "${got[@]:1}"; do
			[[ $i == "$w"* ]] && COMPREPLY+=("${i%%$'\t'*}")
		done
		[[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *= ]] && compopt -o nospace
	elif [[ $kind == files ]]; then
		compopt -o default
	elif [[ $kind ]]; then
		ends=${kind#files }
		w=${w#[\'\"]}
		w=${w//\\/}
		while IFS= read -r i; do
			COMPREPLY+=("$i")
		done < <(compgen -d -- "$w"
			[[ $kind == folder ]] || compgen -f -- "$w" | grep -Ei "\\.(${ends//./\\.})\$" |
				while IFS= read -r i; do [[ -d $i ]] || printf '%s\n' "$i"; done)
		compopt -o filenames
	fi
	[[ $w == *:* && $COMP_WORDBREAKS == *:* ]] &&
		COMPREPLY=("${COMPREPLY[@]#"${w%"${w##*:}"}"}")
	return 0
}
complete -F _ctsr @TOOL@
