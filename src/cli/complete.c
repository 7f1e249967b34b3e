/* complete.c: what a shell offers when a tab is pressed behind a command: see table.h.
 *
 * A value is one of the words of a choice, a file, or a folder; of the files that are written those
 * are offered that end as the row says, and folders on the way to them. What is read is told by its
 * content, so that any file may be meant. An option is not offered beside itself, nor beside one
 * that excludes it. */
#include "config.h"
#include "cli/table.h"

#include <stdio.h>
#include <string.h>

static void put_names(const struct ct_opt *o, const char *between)
{
	if (o->c)
		printf("-%c%s", o->c, between);
	printf("--%s", o->name);
}

static bool excludes(const struct ct_opt *o, const struct ct_opt *other)
{
	for (const struct ct_when *w = o->when; w < o->when + CT_WHENS; w++)
		if (w->kind == CT_WHEN_UNSET && w->at == other->at)
			return true;
	return false;
}

/* The next option from row *k on that cannot stand beside o, or NULL: both are t's own. */
static const struct ct_opt *next_apart(const struct ct_tool *t, const struct ct_opt *o, size_t *k)
{
	const struct ct_opt *other;

	while ((other = ct_table_row(t, (*k)++)))
		if (other->name && other != o && !o->common && !other->common &&
			(excludes(o, other) || excludes(other, o)))
			return other;
	return NULL;
}

/* What excludes it, each behind a blank. */
static void put_apart(const struct ct_tool *t, const struct ct_opt *o)
{
	const struct ct_opt *other;

	for (size_t k = 0; (other = next_apart(t, o, &k));) {
		putchar(' ');
		put_names(other, " ");
	}
}

/* The help up to its first remark, with a backslash before each of `special`, in single quotes. */
static void put_brief(const char *help, const char *special)
{
	for (const char *s = help; *s && *s != ';'; s++) {
		if (s[0] == '.' && s[1] == ' ')
			break;
		if (*s == '\'')
			fputs("'\\'", stdout);
		else if (strchr(special, *s))
			putchar('\\');
		putchar(*s);
	}
}

/* The name of a shell function. */
static const char *function_of(const struct ct_tool *t)
{
	static char name[64];

	snprintf(name, sizeof name, "_%s", t->name);
	for (char *s = name; *s; s++)
		if (*s == '-')
			*s = '_';
	return name;
}

/* How a shell says what a value may be: around the words of a choice; any file; around all ends of
 * files that the row writes, whatever the mode; a folder; anything. */
struct values {
	const char *words, *words_end, *any, *files, *files_end, *folder, *nothing;
};

static void put_value(const struct values *v, const struct ct_opt *o)
{
	const bool ends = o->role != CT_READS_WRITES && o->ends[0].ends;

	if (o->choice) {
		fputs(v->words, stdout);
		for (const char *c = o->arg; *c; c++)
			putchar(*c == '|' ? ' ' : *c);
		fputs(v->words_end, stdout);
	} else if (o->role != CT_NO_FILE && ends) {
		fputs(v->files, stdout);
		for (const struct ct_ends *x = o->ends; x < o->ends + CT_ENDINGS && x->ends; x++)
			printf("%s%s", x == o->ends ? "" : "|", x->ends);
		fputs(v->files_end, stdout);
	} else if (o->role != CT_NO_FILE)
		fputs(v->any, stdout);
	else
		fputs(o->arg && strcmp(o->arg, "DIR") == 0 ? v->folder : v->nothing, stdout);
}

static const char bash_body[] =
	"	local cur key= words= files= ends= apart= given= operand=1 pending= only= i k w\n"
	"	local -a line=()\n"
	"	COMPREPLY=()\n"
	"	for ((i = 1; i <= COMP_CWORD; i++)); do # readline cuts words at = and :\n"
	"		w=${COMP_WORDS[i]}\n"
	"		if ((${#line[@]})) && [[ $w == [=:]* || ${COMP_WORDS[i - 1]} == [=:] ]]; then\n"
	"			line[${#line[@]} - 1]+=$w\n"
	"		else\n"
	"			line+=(\"$w\")\n"
	"		fi\n"
	"	done\n"
	"	cur=${line[${#line[@]} - 1]}\n"
	"	unset \"line[${#line[@]} - 1]\"\n"
	"	for w in \"${line[@]}\"; do\n"
	"		if [[ $pending ]]; then\n"
	"			pending=\n"
	"		elif [[ $only || $w != -?* ]]; then\n"
	"			((operand++))\n"
	"		elif [[ $w == -- ]]; then\n"
	"			only=yes\n"
	"		elif [[ $w == --* ]]; then\n"
	"			given+=\" ${w%%=*}\"\n"
	"			[[ $w != *=* ]] && \"${self}_value\" \"$w\" && pending=$w\n"
	"		else # -fq is -f -q, -x4 is -x 4\n"
	"			for ((k = 1; k < ${#w}; k++)); do\n"
	"				given+=\" -${w:k:1}\"\n"
	"				\"${self}_value\" \"-${w:k:1}\" && break\n"
	"			done\n"
	"			((k == ${#w} - 1)) && pending=-${w:k:1}\n"
	"		fi\n"
	"	done\n"
	"	if [[ $pending ]]; then\n"
	"		key=$pending\n"
	"	elif [[ ! $only && $cur == --*=* ]]; then\n"
	"		key=${cur%%=*} cur=${cur#*=}\n"
	"	elif [[ ! $only && $cur == -* ]]; then\n"
	"		for w in $options; do\n"
	"			[[ $w == \"$cur\"* ]] || continue\n"
	"			apart=\n"
	"			\"${self}_apart\" \"${w%=}\"\n"
	"			for k in $apart; do\n"
	"				[[ \"$given \" == *\" $k \"* ]] && continue 2\n"
	"			done\n"
	"			COMPREPLY+=(\"$w\")\n"
	"		done\n"
	"		[[ ${#COMPREPLY[@]} -eq 1 && $COMPREPLY == *= ]] && compopt -o nospace\n"
	"		return\n"
	"	else\n"
	"		key=$operand\n"
	"	fi\n"
	"	words= files= ends=\n"
	"	\"${self}_value\" \"$key\" || return\n"
	"	if [[ $words ]]; then\n"
	"		COMPREPLY=($(compgen -W \"$words\" -- \"$cur\"))\n"
	"	elif [[ $files == file && ! $ends ]]; then\n"
	"		compopt -o default\n"
	"	elif [[ $files ]]; then\n"
	"		cur=${cur#[\\'\\\"]}\n"
	"		cur=${cur//\\\\/}\n"
	"		while IFS= read -r w; do\n"
	"			COMPREPLY+=(\"$w\")\n"
	"		done < <(compgen -d -- \"$cur\"\n"
	"			[[ ! $ends ]] || compgen -f -- \"$cur\" | grep -Ei \"\\.(${ends//./\\\\.})\\$\" |\n"
	"				while IFS= read -r w; do [[ -d $w ]] || printf '%s\\n' \"$w\"; done)\n"
	"		compopt -o filenames\n"
	"	fi\n"
	"	[[ $cur == *:* && $COMP_WORDBREAKS == *:* ]] &&\n"
	"		COMPREPLY=(\"${COMPREPLY[@]#\"${cur%\"${cur##*:}\"}\"}\")\n"
	"	return 0\n";

int ct_table_show_bash(const struct ct_tool *t, struct ct_err *e)
{
	static const struct values values = {"words='", "' ;;\n", "files=file ends='' ;;\n",
		"files=file ends='", "' ;;\n", "files=folder ;;\n", ";;\n"};
	const char *self = function_of(t);
	const struct ct_opt *o;
	size_t operand = 0;

	(void)e;
	printf("# %s in bash, made by %s --complete=bash\n%s_value()\n{\n\tcase $1 in\n", t->name,
		t->name, self);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (o->name && o->type == CT_T_FLAG)
			continue;
		putchar('\t');
		if (o->name)
			put_names(o, "|");
		else
			printf(o->type == CT_T_LIST ? "[!-]*" : "%zu", ++operand);
		fputs(") ", stdout);
		put_value(&values, o);
	}
	printf("\t*) return 1 ;;\n\tesac\n}\n%s_apart()\n{\n\tcase $1 in\n", self);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (!o->name)
			continue;
		putchar('\t');
		put_names(o, "|");
		fputs(") apart='", stdout);
		put_names(o, " ");
		put_apart(t, o);
		puts("' ;;");
	}
	printf("\tesac\n}\n%s()\n{\n\tlocal self=%s options='", self, self);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (o->name) {
			putchar(' ');
			put_names(o, " ");
			fputs(o->type == CT_T_FLAG ? "" : "=", stdout);
		}
	printf("'\n%s}\ncomplete -F %s %s\n", bash_body, self, t->name);
	return 0;
}

static const struct values zsh_values = {"(", ")' \\\n", "_files' \\\n", "_files -g \"*.(#i)(",
	")(-.)\"' \\\n", "_files -/' \\\n", " ' \\\n"};

/* What a value is called, between colons. */
static void zsh_name(const char *name)
{
	putchar(':');
	for (; *name; name++) {
		if (*name == ':')
			putchar('\\');
		putchar(*name);
	}
	putchar(':');
}

/* One of its two names: what excludes it, the name, what it is, its value. */
static void zsh_option(const struct ct_tool *t, const struct ct_opt *o, bool letter)
{
	const bool flag = o->type == CT_T_FLAG;

	fputs("\t'(", stdout);
	put_names(o, " ");
	put_apart(t, o);
	if (letter)
		printf(")-%c%s[", o->c, flag ? "" : "+");
	else
		printf(")--%s%s[", o->name, flag ? "" : "=");
	put_brief(o->help, "]\\");
	putchar(']');
	if (flag) {
		puts("' \\");
		return;
	}
	zsh_name(o->arg);
	put_value(&zsh_values, o);
}

int ct_table_show_zsh(const struct ct_tool *t, struct ct_err *e)
{
	const struct ct_opt *o;
	size_t operand = 0;

	(void)e;
	printf("#compdef %s\n# %s in zsh, made by %s --complete=zsh\n_arguments -s -S \\\n",
		t->name, t->name, t->name);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (o->name) {
			if (o->c)
				zsh_option(t, o, true);
			zsh_option(t, o, false);
			continue;
		}
		fputs("\t'", stdout);
		if (o->type == CT_T_LIST)
			putchar('*');
		else
			printf("%zu%s", ++operand, o->optional ? ":" : "");
		zsh_name(ct_table_operand(o));
		put_value(&zsh_values, o);
	}
	puts("\t&& return 0");
	return 0;
}

/* Of fish: the number of the operand that stands at the cursor; is one of these options given; the
 * files that end so. */
static void fish_functions(const struct ct_tool *t)
{
	const char *self = function_of(t);
	const struct ct_opt *o;

	printf("function _%s_operand\n"
	       "    set -l n 1\n"
	       "    set -l skip no\n"
	       "    for t in (commandline -opc)[2..-1]\n"
	       "        if test $skip = yes\n"
	       "            set skip no\n"
	       "            continue\n"
	       "        end\n"
	       "        switch $t\n"
	       "            case",
		self);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++)
		if (o->name && o->type != CT_T_FLAG) {
			putchar(' ');
			put_names(o, " ");
		}
	printf("\n"
	       "                set skip yes\n"
	       "            case -\n" /* "?" is no wildcard from fish 4 on */
	       "                set n (math $n + 1)\n"
	       "            case '-*'\n"
	       "            case '*'\n"
	       "                set n (math $n + 1)\n"
	       "        end\n"
	       "    end\n"
	       "    echo $n\n"
	       "end\n"
	       "function _%s_given\n"
	       "    for t in (commandline -opc)[2..-1]\n"
	       "        for o in $argv\n"
	       "            string match -qr -- \"^$o(=.*)?\\$|^-[^-]\" $t\n"
	       "            and string match -q -- \"$o*\" $t\n"
	       "            and return 0\n"
	       "        end\n"
	       "    end\n"
	       "    return 1\n"
	       "end\n"
	       "function _%s_files\n"
	       "    set -l word (commandline -ct | string replace -r -- '^--[^=]*=' '')\n"
	       "    complete -C \"__fish_command_without_completions $word\" |\n"
	       "        string match -ri -- \"^.*(?:/|\\.(?:$argv[1]))(?:\\t.*)?\\$\"\n"
	       "end\n",
		self, self);
}

static void fish_value(const struct ct_tool *t, const struct ct_opt *o)
{
	char files[100];

	snprintf(files, sizeof files, " -x -a '(_%s_files \"", function_of(t));
	put_value(&(const struct values){" -x -a '", "'\n", " -r -F\n", files, "\")'\n",
			  " -x -a '(__fish_complete_directories)'\n", " -x\n"},
		o);
}

static void fish_option(const struct ct_tool *t, const struct ct_opt *o)
{
	size_t k = 0;

	printf("complete -c %s", t->name);
	if (next_apart(t, o, &k)) {
		printf(" -n 'not _%s_given", function_of(t));
		put_apart(t, o);
		putchar('\'');
	}
	if (o->c)
		printf(" -s %c", o->c);
	printf(" -l %s -d '", o->name);
	put_brief(o->help, "\\");
	putchar('\'');
	if (o->type != CT_T_FLAG)
		fish_value(t, o);
	else
		putchar('\n');
}

int ct_table_show_fish(const struct ct_tool *t, struct ct_err *e)
{
	const struct ct_opt *o;
	size_t operand = 0;

	(void)e;
	printf("# %s in fish, made by %s --complete=fish\n", t->name, t->name);
	fish_functions(t);
	printf("complete -c %s -f\n", t->name);
	for (size_t k = 0; (o = ct_table_row(t, k)); k++) {
		if (o->name) {
			fish_option(t, o);
			continue;
		}
		printf("complete -c %s -n 'test (_%s_operand) -%s %zu'", t->name, function_of(t),
			o->type == CT_T_LIST ? "ge" : "eq", operand + 1);
		operand++;
		fish_value(t, o);
	}
	return 0;
}
