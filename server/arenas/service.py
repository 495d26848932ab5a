"""What a person may do with arenas."""

import base64

from sqlalchemy import func, select

from server.arenas.schemas import ArenaRemark, ArenaReview, ArenaReviewRequest, ArenaSummary, ArenaUpload, ArenaView
from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, NotFoundError, UnusableArenaError
from server.services import Services
from server.suites.repository import SuiteRepository
from sim.arenas import build_arenas
from sim.arenas.document import free_area, to_arena, to_document
from sim.arenas.files import read_arena
from sim.arenas.review import review
from sim.config import (
    ADDED_FAMILIES,
    AddedArenaPool,
    AnyArenaConfig,
    ArenaConfig,
    ArenaFile,
    FamilyName,
    GeneratedArenaConfig,
    ImportedArenaConfig,
)
from sim.errors import ArenaFileError

_FIXED = (("Simple", ArenaConfig(name="simple")), ("Complex", ArenaConfig(name="complex")))
_FAMILIES: tuple[tuple[str, FamilyName], ...] = (
    ("Random clutter", "clutter"),
    ("Corridors", "corridors"),
    ("Rooms with doors", "rooms"),
    ("Warehouse aisles", "warehouse"),
    ("Maze", "maze"),
    ("Narrow passages", "passages"),
    ("Thicket of pillars", "thicket"),
    ("Clutter and thickets", "mixed"),
    ("Another family on every map", "varied"),
    ("Another one, more mazes and thickets", "intricate"),
    ("Fields as BARN's", "barn"),
    ("Scenes among people", "people"),
)
_POOLS: tuple[tuple[str, GeneratedArenaConfig | AddedArenaPool], ...] = (
    *((title, GeneratedArenaConfig(name=name)) for title, name in _FAMILIES),
    *((str(family.model_fields["name"].title), family.model_validate({})) for family in ADDED_FAMILIES),
)
_TITLES: dict[str, str] = {config.name: title for title, config in (*_FIXED, *_POOLS)}


class ArenaService:
    """Lists, draws, imports and deletes arenas."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._store = services.arenas

    def gallery(self) -> list[ArenaSummary]:
        """Every arena: built in, families, then imported ones by name."""
        fixed = [
            ArenaSummary(kind="fixed", key=config.name, title=title, config=config, imported_at=None)
            for title, config in _FIXED
        ]
        generated = [
            ArenaSummary(kind="generated", key=config.name, title=title, config=config, imported_at=None)
            for title, config in _POOLS
        ]
        imported = [
            ArenaSummary(
                kind="imported",
                key=stored.document.sha256,
                title=stored.document.name,
                config=ImportedArenaConfig(sha256=stored.document.sha256),
                imported_at=stored.imported_at,
            )
            for stored in self._store.all()
        ]
        return fixed + generated + imported

    def fixed(self, config: ArenaConfig) -> ArenaView:
        """A built-in arena."""
        return self._view(_TITLES[config.name], config, to_document(build_arenas(config)[0]))

    def generated(self, name: str, difficulty: float, seed: int) -> ArenaView:
        """The first map of a family's pool.

        Raises:
            NotFoundError: there is no such family.
        """
        config = next((pool for _, pool in _POOLS if pool.name == name), None)
        if config is None:
            raise NotFoundError.of("family of arenas", name)
        config = config.model_copy(update={"difficulty": difficulty, "seed": seed, "maps": 1, "own_maps": False})
        (arena,) = build_arenas(config)
        return self._view(_TITLES[config.name], config, to_document(arena))

    def imported(self, sha256: str) -> ArenaView:
        """An imported arena.

        Raises:
            NotFoundError: there is none of this hash.
        """
        document = self._store.get(sha256).document
        return self._view(document.name, ImportedArenaConfig(sha256=sha256), document, trainings=self._trainings(sha256))

    def uses(self, sha256: str) -> int:
        """How many trainings use an imported arena.

        Raises:
            NotFoundError: there is none of this hash.
        """
        self._store.get(sha256)
        return self._trainings(sha256)

    def upload(self, upload: ArenaUpload) -> ArenaView:
        """Read an arena's files, and keep it if that is asked for.

        Raises:
            UnusableArenaError: the files are refused, with the reason.
            ConflictError: there are too many arenas already.
        """
        try:
            files = {file.name: base64.b64decode(file.content, validate=True) for file in upload.files}
        except ValueError as error:
            raise UnusableArenaError("The upload is not base64: choose the file again.") from error
        try:
            document = read_arena(files)
        except ArenaFileError as error:
            raise UnusableArenaError(str(error)) from error
        if upload.keep:
            sha256 = self._store.add(document)
            self._note("arena.imported", sha256, document.name)
            return self.imported(sha256)
        config = ImportedArenaConfig(sha256=document.sha256)
        return self._view(document.name, config, document, known=False)

    @staticmethod
    def review(request: ArenaReviewRequest) -> ArenaReview:
        """Look an arena over that is being drawn."""
        arena = request.arena
        found = review(arena, request.clearance)
        return ArenaReview(
            free_area=round(found.free_area, 2),
            free_share=round(found.free_area / (arena.width * arena.height), 4),
            remarks=[ArenaRemark(refused=one.refused, text=one.text, x=one.x, y=one.y) for one in found.remarks],
        )

    def delete(self, sha256: str) -> None:
        """Remove an imported arena.

        Raises:
            NotFoundError: there is none of this hash.
            ConflictError: an experiment trains on it, or a suite has it.
        """
        name = self._store.get(sha256).document.name
        if count := self._trainings(sha256):
            raise ConflictError(
                f"{count} training{'s' if count > 1 else ''} use{'' if count > 1 else 's'} this arena: delete those first."
            )
        with self._services.database.read() as session:
            suites = SuiteRepository(session).using(sha256)
        if suites:
            raise ConflictError(f"It is a scenario of the suite {suites[0]!r}: take it out there first.")
        self._store.delete(sha256)
        self._note("arena.deleted", sha256, name)

    def _note(self, action: str, sha256: str, name: str) -> None:
        with self._services.database.write() as session:
            AuditRepository(session).add(action, target=sha256, name=name)

    def _trainings(self, sha256: str) -> int:
        used = tables.Experiment.training["task"]["arena"]["sha256"].as_string()
        with self._services.database.read() as session:
            return session.scalar(select(func.count()).select_from(tables.Experiment).where(used == sha256)) or 0

    @staticmethod
    def _view(
        title: str, config: AnyArenaConfig, document: ArenaFile, *, known: bool = True, trainings: int = 0
    ) -> ArenaView:
        area = free_area(to_arena(document))
        return ArenaView(
            title=title,
            config=config,
            geometry=document,
            obstacles=len(document.circles) + len(document.boxes),
            free_area=round(area, 2),
            free_share=round(area / (document.width * document.height), 4),
            known=known,
            trainings=trainings,
        )
