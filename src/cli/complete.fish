# @TOOL@ in fish: the command itself says what may stand at the cursor.
function _ctsr
    set -l line (commandline -opc)
    set -l word (commandline -ct)
    set -l got ($line[1] --complete $line[2..-1] "$word" 2>/dev/null)
    set -l head (string match -r -- '^--[^=]*=' "$word")
    set -l rest (string replace -r -- '^--[^=]*=' '' "$word")
    if test "$got[1]" = words
        printf "$head%s\n" $got[2..-1] | string replace -r -- '=\t' '\t'
    else if test -n "$got[1]"
        set -l ends (string replace -r -- '^files ?|folder' '' $got[1])
        test "$got[1]" = files; and set ends '[^/]*'
        for f in (complete -C "__fish_command_without_completions $rest")
            string match -qri -- "^[^\t]*(?:/|\.(?:$ends))(?:\t.*)?\$" $f; or test "$got[1]" = files
            and echo "$head$f"
        end
    end
end
complete -c @TOOL@ -f -a '(_ctsr)'
