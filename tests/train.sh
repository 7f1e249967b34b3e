# train_with ARGS...: ct-train with the keys of every --expert=KEY=VALUE in one option, as it wants them; a later key wins.
train_with() {
	keys= left=$#
	while [ "$left" -gt 0 ]; do
		case $1 in
		--expert=*) keys=$keys,${1#--expert=} ;;
		*) set -- "$@" "$1" ;;
		esac
		shift
		left=$((left - 1))
	done
	ct-train ${keys:+"--expert=${keys#,}"} "$@"
}
