"""`palpate completion`: the script for shell completion."""

import json

import click

from palpate.cli.options import json_option
from palpate.cli.words import OneOf

_VARIABLE = "_PALPATE_COMPLETE"
_BASH = """\
%(complete_func)s() {
    local IFS=$'\\n' words=() word completion type value current after=no
    # bash splits words at : and =, but the name of a source has colons, a setting an equals sign: join them again.
    for word in "${COMP_WORDS[@]:0:COMP_CWORD+1}"; do
        if [[ $word == [:=] || $after == yes ]]; then
            words[${#words[@]}-1]+=$word
        else
            words+=("$word")
        fi
        [[ $word == [:=] ]] && after=yes || after=no
    done
    current=${words[${#words[@]}-1]}
    for completion in $(env COMP_WORDS="${words[*]}" COMP_CWORD=$((${#words[@]} - 1)) %(complete_var)s=bash_complete $1); do
        IFS=',' read type value <<< "$completion"
        if [[ $type == dir ]]; then
            compopt -o dirnames
        elif [[ $type == file ]]; then
            compopt -o default
        elif [[ $current == *[:=]* ]]; then
            COMPREPLY+=("${value#"${current%%"${current##*[:=]}"}"}")
        else
            COMPREPLY+=("$value")
        fi
    done
}

complete -o nosort -F %(complete_func)s %(prog_name)s
"""
_HOW = {
    "bash": 'eval "$(palpate completion bash)"   in ~/.bashrc',
    "zsh": 'eval "$(palpate completion zsh)"   in ~/.zshrc',
    "fish": "palpate completion fish > ~/.config/fish/completions/palpate.fish",
}


@click.command()
@click.argument("shell", type=OneOf(sorted(_HOW)))
@json_option
@click.pass_context
def completion(context: click.Context, shell: str, as_json: bool) -> None:
    """Print a script for shell completion of commands, options and sources.

    \b
    Example:
      bash: eval "$(palpate completion bash)"   in ~/.bashrc
      zsh:  eval "$(palpate completion zsh)"   in ~/.zshrc
      fish: palpate completion fish > ~/.config/fish/completions/palpate.fish
    """  # noqa: D301
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None
    script = _BASH if shell == "bash" else found.source_template
    text = script % found(context.find_root().command, {}, "palpate", _VARIABLE).source_vars()
    click.echo(json.dumps({"shell": shell, "script": text, "use": _HOW[shell]}, indent=2) if as_json else text)
