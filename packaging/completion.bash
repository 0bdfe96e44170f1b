# shellcheck shell=bash
# Completion of supple and supple-mesh in bash, and in zsh through bashcompinit. scripts/manual puts the options in place of the lines @SUPPLE@ and @MESH@.
#
#   supple SCE<TAB>                                 option files and folders
#   supple run.opts -body_<TAB>                     the options of the bodies that run.opts or the command line names
#   supple run.opts -time <TAB>                     the values of an option that has a list of them
#   supple -help <TAB>                              topics
#   supple-mesh <TAB>, supple-mesh tet organ.stl -<TAB>    commands, and the options that the command reads

# option, kind, values, list of names that <name> stands for
_supple_table() {
  cat <<'TABLE'
@SUPPLE@
TABLE
}

# command or option, kind, values, commands that read the option
_supple_mesh_table() {
  cat <<'TABLE'
@MESH@
TABLE
}

# The names in lists like -bodies, -effects: from the scenario and from the command line. $1: pattern of the option without its dash
_supple_names() {
  local file=${COMP_WORDS[1]}
  {
    [ ! -f "$file" ] || cat -- "$file"
    echo
    printf '%s ' "${COMP_WORDS[@]}" | sed 's/ -\([a-z]\)/\n-\1/g'
  } 2>/dev/null | sed -n "s/^ *-\{0,1\}$1[ :=]\{1,\}//p" | sed 's/#.*//; s/["'\'']//g' | tr -s ', \n' '\n' | sort -u
}

# Every option, <name> replaced by the names that there are once the class is typed. $1: what is typed so far
_supple_all() {
  local option kind values list name names last=
  _supple_table | while IFS='|' read -r option kind values list; do
    case $option:$1 in
      *'<name>'*:"${option%%<name>*}"*)
        [ "$list" = "$last" ] || names=$(_supple_names "$list")
        [ "$list" = "$last" ] || [ "$list" != bodies ] || names+=$'\ndefault'
        last=$list
        printf '%s\n' "$names" | while read -r name; do [ -z "$name" ] || printf '%s\n' "${option%%<name>*}$name${option#*<name>}"; done
        ;;
      *'<name>'*) printf '%s\n' "${option%%<name>*}" ;;
      *) printf '%s\n' "$option" ;;
    esac
  done | sort -u
}

# Files whose names end as given, and folders: FILE [ENDING ...]
_supple_files() {
  local cur=$1 file ending
  shift
  compgen -d -- "$cur" | sed 's,$,/,'
  compgen -f -- "$cur" | while IFS= read -r file; do
    [ $# -gt 0 ] || [ -d "$file" ] || printf '%s\n' "$file"
    for ending in "$@"; do case $file in *."$ending") printf '%s\n' "$file" ;; esac done
  done
}

# What may stand as the value of an option: OPTION KIND VALUES
_supple_value() {
  local cur=$2
  case $1:$3:$4 in
    *:bool:*) compgen -W 'true false' -- "$cur" ;;
    *:*:?*) compgen -W "$(printf '%s' "$4" | tr ',' ' ')" -- "$cur" ;;
    *_mesh:text: | *_state:text: | *_copies:text: | *_obstacle:* | *file:* | -restart:* | -view:*) _supple_files "$cur" | sort -u ;;
    *_dir:*) compgen -d -- "$cur" | sed 's,$,/,' ;;
  esac
}

_supple_reply() {
  local IFS=$'\n'
  # shellcheck disable=SC2207
  COMPREPLY=($(cat))
  # a folder or the beginning of a name goes on
  case ${#COMPREPLY[@]}:${COMPREPLY[*]} in 1:*/ | 1:*_) compopt -o nospace 2>/dev/null ;; esac
}

_supple() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} option kind values list pattern
  COMPREPLY=()
  case $prev in
    -help | --help)
      _supple_reply < <(compgen -W "all petsc $(_supple_table | sed -n 's/^-help|[^|]*|\([^|]*\)|.*/\1/p' | tr ',' ' ')" -- "$cur")
      return
      ;;
    -*)
      # the option before the word, with its name put back to <name>
      while IFS='|' read -r option kind values list; do
        pattern=${option/<name>/*}
        # shellcheck disable=SC2254
        case $prev in
          $pattern)
            _supple_reply < <(_supple_value "$option" "$cur" "$kind" "$values")
            return
            ;;
        esac
      done < <(_supple_table | sort -r)
      ;;
  esac
  case $cur in
    -*) _supple_reply < <(compgen -W "$(_supple_all "$cur")" -- "$cur") ;;
    *) _supple_reply < <([ "$COMP_CWORD" != 1 ] || _supple_files "$cur" opts yml yaml | sort -u) ;;
  esac
}

_supple_mesh() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]} option kind values
  COMPREPLY=()
  if [ "$COMP_CWORD" = 1 ]; then
    _supple_reply < <(compgen -W "$(_supple_mesh_table | cut -d '|' -f 1)" -- "$cur")
    return
  fi
  while IFS='|' read -r option kind values; do
    [ "$option" = "$prev" ] || continue
    _supple_reply < <(_supple_value "$option" "$cur" "$kind" "$values")
    return
  done < <(_supple_mesh_table | grep '^-' | cut -d '|' -f 1-3)
  case $cur in
    -*)
      _supple_reply < <(compgen -W "$(_supple_mesh_table | awk -F '|' -v c="$command" '/^-/ && ($4 == "" || index(" " $4 " ", " " c " ")) { print $1 }')" -- "$cur")
      ;;
    *) _supple_reply < <(_supple_files "$cur" | sort -u) ;;
  esac
}

complete -F _supple supple
complete -F _supple_mesh supple-mesh
