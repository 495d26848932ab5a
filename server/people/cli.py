"""`mapless people`: accounts, from the machine that the server runs on."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeVar

import typer
from pydantic import TypeAdapter, ValidationError

if TYPE_CHECKING:
    from server.people.commands import PeopleCommands

app = typer.Typer(help="Accounts, where more than one person uses an installation.", no_args_is_help=True)

DataDir = Annotated[Path | None, typer.Option(help="Where everything is kept [MAPLESS_DATA_DIR, data].")]

_T = TypeVar("_T")


@app.command("create-admin")
def create_admin(
    name: str,
    password: Annotated[
        str, typer.Option(prompt=True, confirmation_prompt=True, hide_input=True, help="Asked for if not given.")
    ],
    data_dir: DataDir = None,
) -> None:
    """Make the account of somebody who administrates; with the first one, signing in begins."""
    from server.people.schemas import Password, UserName

    try:
        name = TypeAdapter(UserName).validate_python(name)
        TypeAdapter(Password).validate_python(password)
    except ValidationError as error:
        _refuse(f"{error.title}: {error.errors()[0]['msg']}")
    _do(data_dir, lambda commands: commands.create_admin(name, password))
    typer.echo(f"{name} may sign in now, and invite others.")


@app.command()
def invite(
    project: Annotated[str | None, typer.Option(help="Name of the project that they join.")] = None,
    role: Annotated[str, typer.Option(help="viewer, editor or admin, in that project.")] = "viewer",
    admin: Annotated[bool, typer.Option("--admin", help="They administrate the installation.")] = False,
    days: Annotated[int, typer.Option(min=1, max=30, help="Until the link ends.")] = 7,
    data_dir: DataDir = None,
) -> None:
    """Print a link by which somebody joins, once."""
    if role not in ("viewer", "editor", "admin"):
        _refuse(f"There is no role {role}: viewer, editor or admin.")
    typer.echo(_do(data_dir, lambda commands: commands.invite(project, role, days, admin=admin)))  # type: ignore[arg-type]


@app.command("password-link")
def password_link(name: str, data_dir: DataDir = None) -> None:
    """Print a link by which somebody sets a new password, once, within a day."""
    typer.echo(_do(data_dir, lambda commands: commands.password_link(name)))


@app.command("list")
def list_people(data_dir: DataDir = None) -> None:
    """List everybody with an account."""
    for line in _do(data_dir, lambda commands: commands.lines()):
        typer.echo(line)


def _do(data_dir: Path | None, work: "Callable[[PeopleCommands], _T]") -> _T:
    from server.errors import ServiceError
    from server.people.commands import PeopleCommands
    from server.settings import Settings

    given: dict[str, Any] = {} if data_dir is None else {"data_dir": data_dir}
    try:
        return work(PeopleCommands(Settings(**given)))
    except (ServiceError, ValidationError) as error:
        _refuse(str(error))


def _refuse(message: str) -> NoReturn:
    typer.echo(f"mapless: {message}", err=True)
    raise typer.Exit(1)
