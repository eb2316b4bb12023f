"""Studies: parameters and calls; each returns results and datasets, and can store them."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.studies.contents import Contents as Contents
    from continuair.studies.contents import damaged as damaged
    from continuair.studies.contents import read as read
    from continuair.studies.results import ResultFolder as ResultFolder
    from continuair.studies.results import add_file as add_file
    from continuair.studies.results import as_json as as_json
    from continuair.studies.results import by_model as by_model
    from continuair.studies.tables import as_csv as as_csv
    from continuair.studies.tables import as_markdown as as_markdown
    from continuair.studies.tables import number as number
    from continuair.studies.timing import flight_alone as flight_alone
    from continuair.studies.timing import median_times as median_times

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "contents": (
            "Contents",
            "damaged",
            "read",
        ),
        "results": (
            "ResultFolder",
            "add_file",
            "as_json",
            "by_model",
        ),
        "tables": (
            "as_csv",
            "as_markdown",
            "number",
        ),
        "timing": (
            "flight_alone",
            "median_times",
        ),
    },
)
