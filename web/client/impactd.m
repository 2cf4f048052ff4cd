function lab = impactd(url, token)
%IMPACTD  Client of impactd, a server that simulates impact dampers, for Octave 7 and MATLAB R2016b or later.
%
%   lab = impactd()                  the server of IMPACTD_SERVER, else http://127.0.0.1:8080; token of IMPACTD_TOKEN
%   lab = impactd(url, token)
%
%   A scene is a struct, the name of a JSON file, or the name of an example. Members are changed by pairs of a path
%   and a value; items of lists are numbered from 0, as in JSON. All quantities are in SI units.
%
%   r = lab.run('paper_free_sponge', 'dampers.0.clearance', 0.01);   r.summary.impacts, r.warnings
%   s = lab.series(r);               s.time, s.displacement ...; lab.series(r, 'displacement') only some channels
%   t = lab.impacts(r);              t(1).start, t(1).peak_force ...
%   [f, p] = lab.psd(r);             frequency [Hz] and density of the first channel of output.psd
%   e = lab.energy(r);               e.initial, e.contact ... [J]
%   lab.save(r, 'motion.csv')        also .npy .npz .mat .svg, .zip for everything
%
%   jobs = lab.submit({scene1, scene2});  results = lab.gather(jobs);    cell arrays, in the same order
%
%   t = lab.sweep(scene, {'dampers.0.clearance', linspace(0.005, 0.025, 5)});   t.dampers_0_clearance, t.rms_displacement
%   a = lab.study('ensemble', scene, struct('runs', 100));                      the answer of any study
%
%   m = lab.materials();  m = lab.material('sponge@1');  d = lab.get('/v1/records')   any GET of the API
%
%   A request that is refused is an error 'impactd:problem' whose message has all faults with their places.
%   Requests are sent by the program curl.

    if nargin < 1 || isempty(url)
        url = getenv('IMPACTD_SERVER');
    end
    if isempty(url)
        url = 'http://127.0.0.1:8080';
    end
    if nargin < 2
        token = getenv('IMPACTD_TOKEN');
    end
    server = struct('url', regexprep(url, '/+$', ''), 'token', token);
    lab = struct();
    lab.url = server.url;
    lab.version = request_json(server, 'GET', '/version');
    lab.get = @(path) request_json(server, 'GET', path);
    lab.scene = @(scene, varargin) scene_make(server, scene, varargin);
    lab.run = @(scene, varargin) job_wait(server, job_post(server, scene_make(server, scene, varargin), 20));
    lab.submit = @(scenes, varargin) jobs_submit(server, scenes, varargin);
    lab.gather = @(jobs) cellfun(@(job) job_wait(server, job), jobs, 'UniformOutput', false);
    lab.series = @(r, varargin) series_read(server, r, varargin);
    lab.impacts = @(r) getfield(request_json(server, 'GET', [r.links.result '/impacts.json']), 'impacts');
    lab.psd = @(r, varargin) psd_read(server, r, varargin{:});
    lab.energy = @(r) request_json(server, 'GET', [r.links.result '/energy.json']);
    lab.save = @(r, file, varargin) result_save(server, r, file, varargin{:});
    lab.sweep = @(scene, axes, varargin) sweep_run(server, scene, axes, varargin);
    lab.study = @(kind, scene, members, varargin) study_run(server, kind, scene, members, varargin);
    lab.materials = @() getfield(request_json(server, 'GET', '/v1/materials'), 'materials');
    lab.material = @(name) request_json(server, 'GET', ['/v1/materials/' name]);
end

% --- scenes ---

function document = scene_make(server, scene, overrides)
% The scene as a struct in which every list is a cell array, with its overrides.
    if isstruct(scene)
        document = scene;
    elseif numel(scene) > 5 && strcmp(scene(end-4:end), '.json')
        document = jsondecode(fileread(scene));
    else
        document = request_json(server, 'GET', ['/v1/examples/' scene]);
    end
    document = lists_restore(document, '');
    if mod(numel(overrides), 2) ~= 0
        error('impactd:usage', 'overrides are pairs: a path such as ''dampers.0.clearance'', then its value');
    end
    for i = 1:2:numel(overrides)
        path = strrep(regexprep(overrides{i}, '^/', ''), '/', '.');
        document = member_set(document, strsplit(path, '.'), overrides{i+1}, overrides{i});
    end
end

function value = lists_restore(value, name)
% jsondecode turns a list of one object into a struct and null into []: cell arrays and NaN are written back as they were.
    lists = {'dampers', 'channels', 'axes', 'values', 'metrics', 'models', 'separations', 'solvers', 'parameters', 'measured', ...
             'inputs', 'variables', 'objectives', 'constraints', 'records', 'levels', 'limits', 'pointers', 'samples', ...
             'masses', 'stiffnesses', 'dampings', 'influence', 'table'};
    is_list = any(strcmp(name, lists));
    if isstruct(value) && (is_list || numel(value) > 1)
        value = num2cell(value(:)');
    elseif is_list && (ischar(value) || (isnumeric(value) && isscalar(value)))
        value = {value};
    elseif isnumeric(value) && isempty(value) && ~is_list
        value = NaN; % null
    end
    if iscell(value)
        value = cellfun(@(item) lists_restore(item, ''), value, 'UniformOutput', false);
    elseif isstruct(value)
        names = fieldnames(value);
        for i = 1:numel(names)
            value.(names{i}) = lists_restore(value.(names{i}), names{i});
        end
    end
end

function document = member_set(document, steps, value, path)
    step = steps{1};
    index = str2double(step) + 1;
    is_last = numel(steps) == 1;
    if iscell(document) && ~isnan(index) && index >= 1 && index <= numel(document)
        if ~is_last
            value = member_set(document{index}, steps(2:end), value, path);
        end
        document{index} = value;
    elseif isstruct(document) && isscalar(document) && isvarname(step)
        if ~is_last
            inner = struct();
            if isfield(document, step)
                inner = document.(step);
            end
            value = member_set(inner, steps(2:end), value, path);
        end
        document.(step) = lists_restore(value, step);
    else
        error('impactd:problem', '%s: the scene has no place of this name (at "%s")', path, step);
    end
end

% --- jobs and results ---

function job = job_post(server, document, seconds)
    % A key of its own: a repeated request cannot run the scene twice.
    [~, name] = fileparts(tempname());
    headers = {sprintf('Idempotency-Key: %s-%.0f', name, now * 86400e3), sprintf('Prefer: wait=%d', seconds)};
    job = request_json(server, 'POST', '/v1/jobs', jsonencode(document), headers);
end

function job = job_wait(server, job)
    while any(strcmp(job.status, {'accepted', 'running'}))
        job = request_json(server, 'GET', ['/v1/jobs/' job.id '?wait=20']);
    end
    if ~strcmp(job.status, 'successful')
        if isstruct(job.problem)
            error('impactd:problem', '%s', problem_text(job.problem));
        end
        error('impactd:problem', 'job %s is %s', job.id, job.status);
    end
end

function jobs = jobs_submit(server, scenes, overrides)
    if ~iscell(scenes)
        scenes = {scenes};
    end
    jobs = cellfun(@(scene) job_post(server, scene_make(server, scene, overrides), 0), scenes, 'UniformOutput', false);
end

function series = series_read(server, r, channels)
    query = '';
    if ~isempty(channels)
        query = ['?channels=' strjoin(channels, ',')];
    end
    file = [tempname() '.mat'];
    clean = onCleanup(@() delete_if_there(file));
    request(server, 'GET', [r.links.result '/series.mat' query], '', {}, file);
    series = load(file);
end

function [frequency, density] = psd_read(server, r, channel)
    document = request_json(server, 'GET', [r.links.result '/psd.json']);
    names = fieldnames(document.channels);
    if nargin < 3
        channel = names{1};
    end
    frequency = document.frequency.values;
    density = document.channels.(channel).values;
end

function result_save(server, r, file, part)
    [~, ~, extension] = fileparts(file);
    if nargin < 4
        part = 'series';
    end
    if strcmp(extension, '.zip')
        part = 'bundle';
    end
    request(server, 'GET', [r.links.result '/' part extension], '', {}, file);
end

% --- studies ---

function [answer, job] = study_run(server, kind, scene, members, overrides)
    parts = struct('sweep', 'table', 'optimize', 'optimum', 'calibrate', 'calibration');
    part = kind;
    if isfield(parts, kind)
        part = parts.(kind);
    end
    document = scene_make(server, scene, overrides);
    members.kind = kind;
    document.study = lists_restore(members, 'study');
    job = job_wait(server, job_post(server, document, 20));
    answer = request_json(server, 'GET', [job.links.result '/' part '.json']);
    answer.links = job.links;
end

function table = sweep_run(server, scene, axes, overrides)
% axes is a cell array {path, values; path, values}: numbers or a cell array of names.
    list = cell(1, size(axes, 1));
    for i = 1:size(axes, 1)
        values = axes{i, 2};
        if isnumeric(values)
            values = num2cell(values(:)');
        end
        list{i} = struct('pointer', ['/' strrep(regexprep(axes{i, 1}, '^/', ''), '.', '/')], 'values', {values});
    end
    answer = study_run(server, 'sweep', scene, struct('axes', {list}), overrides);
    table = struct();
    names = fieldnames(answer.columns);
    for i = 1:numel(names)
        % jsondecode makes x_dampers_0_clearance of /dampers/0/clearance
        table.(regexprep(names{i}, '^x?_', '')) = answer.columns.(names{i}).values;
    end
end

% --- requests ---

function document = request_json(server, method, path, varargin)
    document = jsondecode(request(server, method, path, varargin{:}));
end

function text = request(server, method, path, body, headers, file)
% The answer as text, or in the file. Repeats a request that may be repeated, after 429 and 503 when the server says.
    if nargin < 5
        headers = {};
    end
    is_text = nargin < 6;
    target = tempname();
    clean = onCleanup(@() delete_if_there(target));
    command = ['curl -sS -o ' quoted(target) ' -w "%{http_code}" -X ' method];
    if strcmp(method, 'GET') || ~isempty(headers)
        command = [command ' --retry 8 --retry-max-time 600'];
    end
    if nargin > 3 && ~isempty(body)
        sent = tempname();
        clean_sent = onCleanup(@() delete_if_there(sent));
        handle = fopen(sent, 'w');
        fwrite(handle, unicode2native(body, 'UTF-8'));
        fclose(handle);
        headers{end+1} = 'Content-Type: application/json';
        command = [command ' --data-binary ' quoted(['@' sent])];
    end
    for i = 1:numel(headers)
        command = [command ' -H ' quoted(headers{i})];
    end
    if ~isempty(regexp(path, '^https?://', 'once'))
        path = regexprep(path, '^https?://[^/]*', '');
    end
    base = regexprep(server.url, '^https?://[^/]*', '');
    if ~isempty(base) && strncmp(path, [base '/'], numel(base) + 1)
        path = path(numel(base)+1:end); % a link has the base path already
    end
    command = [command ' ' quoted([server.url path])];
    if ~isempty(server.token) && ispc()
        command = [command ' -H ' quoted(['Authorization: Bearer ' server.token])];
    elseif ~isempty(server.token)
        % By standard input: command lines can be read by other users.
        setenv('IMPACTD_CLIENT_HEADER', ['Authorization: Bearer ' server.token]);
        command = ['printf ''header = "%s"\n'' "$IMPACTD_CLIENT_HEADER" | ' command ' -K -'];
    end
    [code, out] = system([command ' 2>&1']);
    if code ~= 0
        error('impactd:connection', 'no answer from %s: %s', server.url, strtrim(regexprep(out, '\d+$', '')));
    end
    if str2double(out(max(end-2, 1):end)) >= 400
        text = fileread(target);
        try
            text = problem_text(jsondecode(text));
        catch
        end
        error('impactd:problem', '%s', text);
    end
    if is_text
        text = fileread(target);
    else
        [done, message] = movefile(target, file);
        if ~done
            error('impactd:file', '%s cannot be written: %s', file, message);
        end
        text = '';
    end
end

function text = problem_text(problem)
% The title and a line for each fault with its place.
    text = problem.title;
    if ~isfield(problem, 'errors') || isempty(problem.errors)
        text = sprintf('%s: %s', text, problem.detail);
        return
    end
    faults = problem.errors;
    if ~iscell(faults)
        faults = num2cell(faults);
    end
    for i = 1:numel(faults)
        text = sprintf('%s\n  %s: %s', text, faults{i}.pointer, faults{i}.detail);
        if isfield(faults{i}, 'did_you_mean') && ~isempty(faults{i}.did_you_mean)
            text = sprintf('%s; did you mean "%s"?', text, faults{i}.did_you_mean);
        end
    end
end

function text = quoted(text)
% One word of a command line.
    if ispc()
        text = ['"' strrep(text, '"', '\"') '"'];
    else
        text = ['''' strrep(text, '''', '''\''''') ''''];
    end
end

function delete_if_there(file)
    if exist(file, 'file')
        delete(file);
    end
end
